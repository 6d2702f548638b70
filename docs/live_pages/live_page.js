// SPDX-License-Identifier: BSD-3-Clause
// A live page: a model as text, sliders for its parameters, its motion and a plot. kempe_page.js gives `Kempe`; without it, or without
// WebAssembly, the page says so and keeps its text.
const WAIT = 200; // ms after the last key or move of a slider

function startLive(page) {
    const at = (id) => document.getElementById(id), text = at("text"), said = at("said");
    const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    let kempe, table, control, timer, frame = 0, plays = !matchMedia("(prefers-reduced-motion: reduce)").matches;

    /* -- text and errors -- */

    const showLines = (wrong = []) => {
        const count = text.value.split("\n").length;
        at("lines").replaceChildren(...Array.from({ length: count }, (_, k) => {
            const line = document.createElement("div");
            line.textContent = k + 1;
            line.className = wrong.includes(k + 1) ? "wrong" : "";
            return line;
        }));
        text.rows = count + 1;
    };
    const say = (sentence, wrong = false) => {
        said.textContent = sentence;
        said.className = wrong ? "wrong" : "";
    };

    /* -- pictures -- */

    const sized = (canvas) => {
        const ratio = devicePixelRatio || 1;
        canvas.width = canvas.clientWidth * ratio;
        canvas.height = canvas.clientHeight * ratio;
        const context = canvas.getContext("2d");
        context.scale(ratio, ratio);
        return [context, canvas.clientWidth, canvas.clientHeight];
    };
    const has = (point) => table.names.includes(`position.${point}.x`);
    const place = (point, row) => ["x", "y"].map((axis) => table.column(`position.${point}.${axis}`)[row]);

    const drawScene = () => {
        const [context, width, height] = sized(at("scene")), points = [...new Set(page.bars.flat())].filter(has);
        const extent = [0, 1].map((axis) => {
            const all = points.flatMap((point) => [...table.column(`position.${point}.${"xy"[axis]}`)]);
            return [Math.min(...all), Math.max(...all)];
        });
        if (!points.length) return;
        const scale = 0.85 * Math.min(width / (extent[0][1] - extent[0][0] || 1), height / (extent[1][1] - extent[1][0] || 1));
        const middle = extent.map(([low, high]) => (low + high) / 2);
        const to = ([x, y]) => [width / 2 + scale * (x - middle[0]), height / 2 - scale * (y - middle[1])];
        const line = (places, stroke, thick) => {
            context.beginPath();
            places.forEach((p, k) => (k ? context.lineTo(...to(p)) : context.moveTo(...to(p))));
            context.strokeStyle = stroke;
            context.lineWidth = thick;
            context.lineCap = context.lineJoin = "round";
            context.stroke();
        };
        if (has(page.trace)) line(Array.from({ length: table.rowCount }, (_, row) => place(page.trace, row)), colour("--line"), 2);
        for (const [one, other] of page.bars) if (has(one) && has(other)) line([place(one, frame), place(other, frame)], colour("--accent"), 6);
        for (const point of points) {
            context.beginPath();
            context.arc(...to(place(point, frame)), page.ground.includes(point) ? 7 : 5, 0, 2 * Math.PI);
            context.fillStyle = colour(page.ground.includes(point) ? "--ink" : "--card");
            context.strokeStyle = colour("--ink");
            context.lineWidth = 2;
            context.fill();
            context.stroke();
        }
    };
    const drawPlot = () => {
        const [context, width, height] = sized(at("plot")), times = table.column("t"), name = at("column").value, values = table.column(name);
        const low = Math.min(...values), high = Math.max(...values), end = times[times.length - 1] || 1;
        const to = (row) => [8 + (width - 16) * times[row] / end, height - 18 - (height - 36) * (values[row] - low) / (high - low || 1)];
        context.strokeStyle = colour("--accent");
        context.lineWidth = 1.5;
        context.beginPath();
        for (let row = 0; row < times.length; row++) context[row ? "lineTo" : "moveTo"](...to(row));
        context.stroke();
        context.fillStyle = colour("--ink");
        context.beginPath();
        context.arc(...to(frame), 4, 0, 2 * Math.PI);
        context.fill();
        context.fillStyle = colour("--soft");
        context.font = "12px system-ui, sans-serif";
        context.fillText(`${high.toPrecision(4)} ${table.unit(name)}`, 8, 12);
        context.fillText(`${low.toPrecision(4)} ${table.unit(name)}`, 8, height - 4);
        context.textAlign = "right";
        context.fillText(`${name} = ${values[frame].toPrecision(5)} ${table.unit(name)}`, width - 8, 12);
        context.fillText(`${end} s`, width - 8, height - 4);
    };
    const draw = () => {
        if (!table) return;
        at("clock").textContent = `${table.column("t")[frame].toFixed(2)} s`;
        drawScene();
        drawPlot();
    };

    /* -- time -- */

    const end = () => table.column("t")[table.rowCount - 1];
    const goTo = (time) => {
        const times = table.column("t");
        frame = times.findIndex((t) => t >= time);
        if (frame < 0) frame = table.rowCount - 1;
        draw();
    };
    const showPlays = () => { at("play").textContent = plays ? "Pause" : "Play"; };
    let last;
    const tick = (now) => {
        if (plays && table && last !== undefined) {
            const time = (Number(at("time").value) + (now - last) / 1000) % end();
            at("time").value = time;
            goTo(time);
        }
        last = now;
        requestAnimationFrame(tick);
    };
    at("play").onclick = () => { plays = !plays; showPlays(); };
    at("time").oninput = () => { plays = false; showPlays(); if (table) goTo(Number(at("time").value)); };
    at("column").onchange = draw;
    addEventListener("resize", draw);

    /* -- runs -- */

    const take = (result, seconds) => {
        table = result.table;
        const chosen = at("column").value || page.column;
        const numbers = table.names.filter((name) => name !== "t");
        at("column").replaceChildren(...numbers.map((name) => new Option(name, name)));
        at("column").value = numbers.includes(chosen) ? chosen : numbers[0];
        at("time").max = end();
        if (Number(at("time").value) > end()) at("time").value = 0;
        showLines();
        say([`${result.text.split("\n")[0]} (${Math.round(1000 * seconds)} ms)`, ...result.messages.map((message) => message.text)].join("\n"));
        goTo(Number(at("time").value));
    };
    const run = async () => {
        control?.abort();
        control = new AbortController();
        const own = control, began = performance.now();
        const set = page.sliders.filter((slider) => slider.moved).map((slider) => `${slider.name}=${slider.input.value}`);
        try {
            const result = await kempe.simulate(text.value, { set, noConvergenceCheck: true }, { signal: own.signal });
            if (own === control) take(result, (performance.now() - began) / 1000);
        } catch (error) {
            if (own !== control || error.name === "AbortError") return;
            showLines((error.messages ?? []).map((message) => message.line));
            say(error.message, true);
        }
    };
    const runSoon = () => { clearTimeout(timer); timer = setTimeout(run, WAIT); };

    for (const slider of page.sliders) {
        const row = document.createElement("label"), input = document.createElement("input"), value = document.createElement("output");
        row.className = "slider";
        Object.assign(input, { type: "range", min: slider.from, max: slider.to, step: "any", value: slider.value });
        const show = () => { value.textContent = `${Number(input.value).toPrecision(3)} ${slider.unit}`; };
        input.oninput = () => { slider.moved = true; show(); if (kempe) runSoon(); };
        slider.input = input;
        show();
        row.append(slider.name, input, value);
        at("values").append(row);
    }
    text.oninput = () => { showLines(); if (kempe) runSoon(); };
    showLines();
    showPlays();
    if (typeof Kempe !== "function" || typeof WebAssembly !== "object") {
        say("The mechanism cannot move here: kempe_page.js, which packaging/build_wasm makes, or WebAssembly is missing.", true);
        return null;
    }
    say("Kempe is starting ..");
    return Kempe.start().then(async (started) => {
        kempe = started;
        await run();
        requestAnimationFrame(tick);
    }).catch((error) => say(error.message, true));
}
