// SPDX-License-Identifier: BSD-3-Clause
// A live page: a model as text, its motion, plots, and sliders for its parameters. The data of the page (docs/live_examples.py) has
// the files of the model and, of their run, what is shown at once. kempe_page.js, which is loaded behind that, gives `Kempe`, and
// live_scene.js draws what `--animation FILE.json` says, as report pages do.
// All that a model or a message says is put into the page as text.
"use strict";

(() => {
    const TYPED = 250; // ms after the last key before a run begins
    const CHECKED = 700; // ms without a change before the run is repeated at another tolerance
    const LONGEST = 20; // s, after which a run is given up
    const MOST_PLOTS = 4;
    const live = data.live, files = new Map(live.files.map(({ name, text, bytes }) => [name, text ?? new Uint8Array(bytesOf(bytes))]));
    const main = live.files[0].name, first = new Map(files);
    const text = byId("text"), editor = byId("editor");
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    let kempe = null, result = null, edited = main, wrong = [];

    /* -- the answer ----------------------------------------------------------------------------------------- */

    const say = (state, line, more = []) => {
        const mark = element("span.mark", MARKS[state] ?? (state === "wrong" ? MARKS.failed : "\u2026"));
        mark.setAttribute("aria-hidden", "true");
        byId("answer").dataset.state = state;
        byId("line").replaceChildren(mark, line);
        byId("more").replaceChildren(...more);
    };

    /* Before the places of errors: those in the model that is shown have a line to go to. */
    const sentenceOf = (message) => {
        if (!message.file) return element("li", message.text);
        const place = buttonOf(`${message.file.split("/").pop()}, line ${message.line}`, false, () => goToLine(message));
        place.removeAttribute("aria-pressed");
        return element("li", place, ` ${message.text}`);
    };

    /* -- the text ------------------------------------------------------------------------------------------- */

    const lineHeight = () => parseFloat(getComputedStyle(text).lineHeight);

    const markLines = () => {
        const own = wrong.filter(({ file }) => file === edited), top = parseFloat(getComputedStyle(text).paddingTop);
        const numbers = text.value.split("\n").map((_, k) => {
            const number = element("div", String(k + 1));
            number.className = own.some(({ line }) => line === k + 1) ? "wrong" : "";
            return number;
        });
        byId("lines").replaceChildren(...numbers);
        byId("marks").replaceChildren(...own.map(({ line, text: sentence }, k) => {
            const band = element("div.band"), words = element("div.words", sentence);
            band.style.top = `${top + (line - 1) * lineHeight()}px`;
            words.style.top = `${top + line * lineHeight()}px`;
            words.hidden = k > 0 && own[k - 1].line === line;
            return [band, words];
        }).flat());
        text.setAttribute("aria-invalid", String(own.length > 0));
        follow();
    };
    const follow = () => {
        byId("lines").scrollTop = text.scrollTop;
        byId("marks").style.transform = `translateY(${-text.scrollTop}px)`;
    };
    const goToLine = ({ file, line, column = 1 }) => {
        if (file !== edited && typeof files.get(file) === "string") edit(file);
        const before = text.value.split("\n").slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
        text.focus();
        text.setSelectionRange(before + column - 1, before + column - 1);
        text.scrollTop = Math.max(0, (line - 4) * lineHeight());
        follow();
    };
    const edit = (name) => {
        edited = name;
        text.value = files.get(name);
        byId("file").value = name;
        markLines();
    };
    const isAsGiven = () => [...files].every(([name, content]) => first.get(name) === content);
    const change = () => {
        files.set(edited, text.value);
        wrong = [];
        markLines();
        readSliders();
        byId("reset").disabled = isAsGiven();
    };

    /* -- sliders -------------------------------------------------------------------------------------------- */

    /* The first and last place of a parameter's number in the text; null: the text gives none. */
    const placeOf = (name) => {
        const whole = files.get(main), section = /^parameters:[^]*?(?=\n[A-Za-z]|$(?![^]))/m.exec(whole);
        const found = section && new RegExp(`(?:^|[{,\\s])${name}:[ \\t]*(-?[0-9.]+(?:[eE][-+]?[0-9]+)?)`, "m").exec(section[0]);
        const end = found && section.index + found.index + found[0].length;
        return found ? [end - found[1].length, end] : null;
    };
    const rounded = (slider, x) => String(Number(x.toPrecision(3 + (Math.abs(x) > 100 * slider.step ? 1 : 0))));
    const makeSlider = (slider) => {
        const row = element("label.slider"), input = element("input"), value = element("output");
        Object.assign(input, { type: "range", min: slider.from, max: slider.to, step: slider.step });
        input.dataset.parameter = slider.name;
        input.addEventListener("input", () => {
            const place = placeOf(slider.name), whole = files.get(main);
            if (!place) return;
            files.set(main, whole.slice(0, place[0]) + rounded(slider, Number(input.value)) + whole.slice(place[1]));
            const [top, left] = [text.scrollTop, text.scrollLeft];
            if (edited === main) text.value = files.get(main);
            [text.scrollTop, text.scrollLeft] = [top, left];
            change();
            runOften();
        });
        row.append(element("span", slider.name), input, value);
        Object.assign(slider, { input, value });
        return row;
    };
    const readSliders = () => {
        for (const { name, unit, input, value } of live.sliders) {
            const place = placeOf(name);
            input.disabled = !place;
            if (!place) continue;
            const words = files.get(main).slice(...place), number = Number(words);
            if (number < Number(input.min)) input.min = number;
            if (number > Number(input.max)) input.max = number;
            input.value = number;
            value.textContent = `${words} ${unit}`.trim();
            input.setAttribute("aria-valuetext", value.textContent);
        }
    };

    /* -- the moving mechanism ------------------------------------------------------------------------------- */

    const canvas = byId("view"), gauge = drawn2d("svg", { class: "gauge", "aria-hidden": "true" }), label = element("span.label-at");
    const orbit = { yaw: 0, pitch: 0, zoom: 1, home: { yaw: 0, pitch: 0 } }, hidden = new Set();
    let scene = null, view = null, shown = null, t = 0, plays = !calm, last = 0, looks = "";

    const span = () => [scene.picture.frames.t_start, scene.picture.frames.t_end];
    const secondsOf = (range) => (range >= 1.5 && range <= 12 ? range : 8);

    /* The arrows of forces, and their switch, which remains as the reader has set it. */
    const takeForces = (picture, reactions) => {
        const chosen = forces && byId("by-force") ? forces.shown : null;
        data.reactions = reactions && { columns: ["joint", "unique"], rows: reactions.map(({ joint, unique }) => [joint, unique === false ? 0 : 1]) };
        forces = picture.arrows ? readForces(picture.arrows) : null;
        if (forces && chosen !== null) forces.shown = chosen;
        const made = forceSwitch(drawScene);
        byId("forces").replaceChildren(...(made ? [made] : []));
    };
    const takePicture = (picture, reactions) => {
        isFlexible = Boolean(picture.flexible);
        takeForces(picture, reactions);
        scene = makeMechanism(picture);
        view = canvasView(canvas, scene);
        if (String(scene.home.yaw) !== looks) Object.assign(orbit, scene.home, { home: scene.home, zoom: 1 });
        for (const b of [...hidden]) if (b >= picture.bodies.length) hidden.delete(b);
        renewNames();
        if (looks === "") beginViews(canvas, gauge, { orbit, draw: drawScene, length: () => span()[1] - span()[0], seconds: () => secondsOf(span()[1] - span()[0]), show: (time) => { play(false); goTo(span()[0] + time); } });
        looks = String(scene.home.yaw);
        byId("still").hidden = true;
        byId("moving").hidden = false;
        canvas.dataset.bodies = picture.bodies.length;
        window.shownPicture = scene; // for external tests
    };
    const renewNames = () => {
        if (isFlexible) hidePlaces(scene.picture, hidden);
        writeNames(scene.picture.bodies, hidden, () => { renewNames(); drawScene(); });
    };
    const drawScene = () => {
        if (!scene) return;
        const width = Math.max(canvas.clientWidth, 50), height = Math.max(canvas.clientHeight, 50), border = 9 * scene.thick;
        const scale = orbit.zoom * Math.min(width / (2 * (1.12 * scene.extent.width + border)), height / (2 * (1.12 * scene.extent.height + border)));
        shown = [scene, scene.motion(t), { width, height, scale, hidden, ...turnedBasis(scene.basis, orbit.yaw, orbit.pitch) }];
        view.draw(...shown.slice(1));
        gauge.setAttribute("viewBox", `0 0 ${width} ${height}`);
        drawGauge(gauge, scene, shown[2]);
        gauge.append(...forceArrows(...shown, t));
    };
    const draw = () => {
        if (!scene) return;
        drawScene();
        plots.forEach(drawCurves);
        const [begin, end] = span();
        byId("clock").textContent = clockOf(t, end - begin);
        byId("time").setAttribute("aria-valuetext", byId("clock").textContent);
    };
    const goTo = (time) => {
        const [begin, end] = span();
        t = Math.min(Math.max(time, begin), end);
        byId("time").value = end > begin ? (1000 * (t - begin)) / (end - begin) : 0;
        draw();
    };
    const play = (on) => {
        plays = on;
        byId("play").textContent = plays ? "Pause" : "Play";
        byId("play").setAttribute("aria-pressed", String(plays));
    };
    const tick = (now) => {
        if (plays && scene && span()[1] > span()[0]) {
            const [begin, end] = span(), range = end - begin;
            goTo(begin + ((t - begin + (Math.min(now - last, 100) / 1000) * (range / secondsOf(range))) % range));
        }
        last = now;
        requestAnimationFrame(tick);
    };

    /* -- plots ---------------------------------------------------------------------------------------------- */

    const plots = [];

    const choicesOf = (table) => plotChoices(table, COLOURS.length);
    const addPlot = (chosen) => {
        const plot = { canvas: element("canvas"), list: element("select"), values: element("span.values"), chosen };
        const off = buttonOf("Remove", false, () => {
            plots.splice(plots.indexOf(plot), 1);
            plot.figure.remove();
            byId("add").disabled = false;
        });
        off.removeAttribute("aria-pressed");
        plot.list.setAttribute("aria-label", "plotted outputs");
        plot.canvas.setAttribute("role", "img");
        plot.list.addEventListener("change", () => { plot.chosen = plot.list.value; drawCurves(plot); });
        const seek = (event) => {
            if (!scene || (event.type === "pointermove" && !event.buttons)) return;
            const box = plot.canvas.getBoundingClientRect(), { left, right } = plot.area;
            play(false);
            goTo(span()[0] + ((event.clientX - box.left - left) / (right - left)) * (span()[1] - span()[0]));
        };
        for (const kind of ["pointerdown", "pointermove"]) plot.canvas.addEventListener(kind, seek);
        plot.figure = element("figure", element("figcaption", plot.list, plot.values, off), plot.canvas);
        plots.push(plot);
        byId("curves").append(plot.figure);
        byId("add").disabled = plots.length >= MOST_PLOTS;
        listColumns(plot);
    };
    const listColumns = (plot) => {
        if (!result?.table) return;
        const choices = choicesOf(result.table);
        plot.list.replaceChildren(...[...choices.keys()].map((key) => optionOf(key, key)));
        if (!choices.has(plot.chosen)) plot.chosen = firstChoices(choices)[0] ?? "";
        plot.list.value = plot.chosen;
        plot.names = choices.get(plot.chosen) ?? [];
    };
    const rangeOfAll = (table, names) => {
        let low = Infinity, high = -Infinity;
        for (const name of names)
            for (const x of table.column(name)) if (isFinite(x)) [low, high] = [Math.min(low, x), Math.max(high, x)];
        if (!(low <= high)) [low, high] = [0, 1];
        const room = high > low ? 0.06 * (high - low) : 0.1 * Math.abs(high) || 1;
        return [low - room, high + room];
    };
    const ticksOf = (low, high, most) => {
        const apart = [1, 2, 5, 10].map((k) => k * 10 ** Math.floor(Math.log10((high - low) / most))).find((x) => (high - low) / x <= most);
        return Array.from({ length: Math.floor(high / apart) - Math.ceil(low / apart) + 1 }, (_, k) => (Math.ceil(low / apart) + k) * apart);
    };
    const drawCurves = (plot) => {
        const table = result?.table;
        if (!table || !scene) return;
        plot.names = choicesOf(table).get(plot.chosen) ?? [];
        const sharp = devicePixelRatio || 1, width = plot.canvas.clientWidth, height = plot.canvas.clientHeight, c = plot.canvas.getContext("2d");
        const times = table.column("t"), [begin, end] = [times[0], Math.max(times[times.length - 1], times[0] + 1e-12)], [low, high] = rangeOfAll(table, plot.names);
        const area = (plot.area = { left: 58, right: width - 10, top: 8, foot: height - 22 });
        const x = (time) => area.left + ((area.right - area.left) * (time - begin)) / (end - begin);
        const y = (value) => area.foot - ((area.foot - area.top) * (value - low)) / (high - low);
        plot.canvas.width = Math.round(width * sharp);
        plot.canvas.height = Math.round(height * sharp);
        c.scale(sharp, sharp);
        c.font = "12px system-ui, sans-serif";
        c.fillStyle = softColour();
        const grid = (words, from, to, align, base, at) => {
            strokeLine(c, [from, to], 1, lineColour());
            c.textAlign = align;
            c.textBaseline = base;
            c.fillText(words, ...at);
        };
        const words = (value, apart) => three(Math.abs(value) < 1e-9 * apart ? 0 : Number(value.toPrecision(8)));
        for (const value of ticksOf(low, high, 5)) grid(words(value, high - low), [area.left, y(value)], [area.right, y(value)], "right", "middle", [area.left - 6, y(value)]);
        for (const time of ticksOf(begin, end, Math.max(2, width / 90))) grid(`${words(time, end - begin)} s`, [x(time), area.top], [x(time), area.foot], x(time) > area.right - 20 ? "right" : "center", "top", [x(time), area.foot + 6]);
        plot.names.forEach((name, k) => {
            const column = table.column(name), every = Math.max(1, Math.floor(times.length / 2000)), points = [];
            for (let row = 0; row < times.length; row += every) if (isFinite(column[row])) points.push([x(times[row]), y(column[row])]);
            strokeLine(c, points, 1.8, curveColour(k));
        });
        strokeLine(c, [[x(t), area.top], [x(t), area.foot]], 1.2, inkColour());
        const [before, behind, part] = placeIn(times, t);
        plot.values.replaceChildren(...plot.names.map((name, k) => {
            const column = table.column(name), value = (1 - part) * column[before] + part * column[behind];
            return element("span", swatchOf(curveColour(k)), `${plot.names.length > 1 ? name.split(".").slice(1).join(".") || name : name} ${digits(value, 4)}`);
        }));
        plot.canvas.setAttribute("aria-label", `${plot.chosen} over time, from ${three(low)} to ${three(high)}`);
    };

    /* -- runs ----------------------------------------------------------------------------------------------- */

    let control = null, typing = 0, checking = 0, again = false;

    /* The end that the page has instead of the model's, as long as the text has the end that it had. */
    const lines = /^.*\bt_end:.*$/m;
    const endOf = () => (live.end && lines.exec(files.get(main))?.[0] === lines.exec(first.get(main))?.[0] ? { tEnd: live.end } : {});

    const compute = (options, signal) => kempe.simulate(Object.fromEntries(files), { ...endOf(), ...options }, { signal });

    const answer = (outcome, seconds) => {
        const status = outcome.summary?.status ?? "", state = outcome.code === 5 ? "not trustworthy" : status in MARKS ? status : "complete";
        const warnings = outcome.messages.map(sentenceOf);
        say(state, neat(outcome.text.split("\n")[0]), warnings);
        byId("took").textContent = `${seconds === null ? "computed when this page was made" : `computed in ${duration(seconds)}`}${endOf().tEnd ? `; the page shows the first ${live.end} s: ${live.reason}` : ""}`;
    };
    const take = (outcome, picture, seconds) => {
        const before = scene && t;
        result = outcome;
        wrong = [];
        if (picture) takePicture(picture, outcome.summary?.reactions);
        markLines();
        answer(outcome, seconds);
        if (plots.length === 0) for (const key of firstChoices(choicesOf(outcome.table))) addPlot(key);
        plots.forEach(listColumns);
        if (scene) goTo(before || span()[0]);
        canvas.dataset.runs = Number(canvas.dataset.runs ?? 0) + (seconds !== null); // in this page
        const step = seconds === null ? "drawn" : "repeated";
        if (scene && !performance.getEntriesByName(`live page: ${step}`).length) performance.mark(`live page: ${step}`);
        document.documentElement.dataset.ready = "yes";
    };
    const pictureOf = ({ files: { "motion.json": bytes } }) => (bytes ? JSON.parse(new TextDecoder().decode(bytes)).picture : null);

    /* The run of the model as it is given, from the data of the page: second differences are added up (first_runs.mjs). */
    const summed = ({ width, differences }) => {
        const rows = differences.length / width, made = new Int16Array(differences.length);
        for (let c = 0; c < width; c++)
            for (let k = 0, value = 0, step = 0; k < rows; k++) made[k * width + c] = value += step += differences[c * rows + k];
        return made;
    };
    const summedAll = (owner) => {
        for (const [key, value] of Object.entries(owner ?? {})) if (value?.differences) owner[key] = summed(value);
    };
    const takeGiven = ({ picture, columns, ...outcome }) => {
        const { flexible } = picture, named = new Map(columns.map(({ name, unit, values }) => [name, { unit, values: Float64Array.from(values) }]));
        [picture.frames, picture.arrows, flexible?.shift, flexible?.turn, flexible?.stress].forEach(summedAll);
        take({ ...outcome, table: { names: [...named.keys()], column: (name) => named.get(name).values, unit: (name) => named.get(name).unit } }, picture, null);
    };
    const fail = (error) => {
        wrong = (error.messages ?? []).filter(({ line, level }) => line && level === "error");
        markLines();
        const messages = (error.messages ?? []).filter(({ level }) => level === "error"), [one, ...more] = messages;
        say("wrong", one ? (one.file ? `${one.file.split("/").pop()}, line ${one.line}: ${one.text}` : one.text) : error.message, more.map(sentenceOf));
        byId("took").textContent = scene ? "The picture shows the last motion." : "";
        document.documentElement.dataset.ready = "yes";
    };
    const run = async () => {
        if (!kempe) return say("begins", "Kempe is starting; then the change is computed.");
        clearTimeout(typing);
        clearTimeout(checking);
        control?.abort();
        const own = (control = new AbortController()), began = performance.now();
        const limit = setTimeout(() => own.abort(new Error(`The run was given up after ${LONGEST} s: shorten its end, t_end, or loosen its tolerance, rtol.`)), 1000 * LONGEST);
        byId("answer").classList.add("runs");
        try {
            const outcome = await compute({ noConvergenceCheck: true, animation: "/out/motion.json" }, own.signal);
            if (own !== control) return;
            take(outcome, pictureOf(outcome), (performance.now() - began) / 1000);
            checking = setTimeout(() => check(own), CHECKED);
        } catch (error) {
            if (own !== control || error.name === "AbortError") return;
            fail(error);
        } finally {
            clearTimeout(limit);
            own.done = true;
        }
        byId("answer").classList.remove("runs");
        if (!again) return;
        again = false;
        run();
    };
    /* The run of the model as it is given, with its check, while what it takes the place of is shown; a change ends it. */
    const repeat = async () => {
        const own = (control = Object.assign(new AbortController(), { done: true })), began = performance.now();
        try {
            const outcome = await compute({ animation: "/out/motion.json" }, own.signal);
            if (own !== control) return;
            take(outcome, pictureOf(outcome), (performance.now() - began) / 1000);
            byId("answer").dataset.checked = "yes";
        } catch (error) {
            if (own === control && error.name !== "AbortError") fail(error);
        }
    };
    /* The same run with its convergence at another tolerance, which says whether to trust it. */
    const check = async (own) => {
        const began = performance.now();
        try {
            const outcome = await compute({}, own.signal);
            if (own === control) answer(outcome, (performance.now() - began) / 1000);
        } catch (error) {
            if (own === control && error.name !== "AbortError") fail(error);
        }
        byId("answer").dataset.checked = "yes";
    };
    const runSoon = () => {
        clearTimeout(typing);
        typing = setTimeout(run, TYPED);
    };
    /* While a slider moves, one run follows the other. */
    const runOften = () => {
        if (control && !control.done) again = true;
        else run();
    };

    /* -- the beginning -------------------------------------------------------------------------------------- */

    const begin = () => {
        byId("sliders").append(...live.sliders.map(makeSlider));
        byId("sliders").hidden = live.sliders.length === 0;
        const texts = live.files.filter((file) => file.text !== undefined);
        byId("file").append(...texts.map(({ name }) => optionOf(name.split("/").pop(), name)));
        byId("file").hidden = texts.length < 2;
        byId("file").addEventListener("change", () => edit(byId("file").value));
        edit(main);
        readSliders();
        text.addEventListener("input", () => { change(); runSoon(); });
        text.addEventListener("scroll", follow);
        text.addEventListener("keydown", (event) => {
            if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
            event.preventDefault();
            run();
        });
        byId("reset").addEventListener("click", () => {
            for (const [name, content] of first) files.set(name, content);
            edit(edited);
            change();
            run();
        });
        byId("add").addEventListener("click", () => { addPlot(""); draw(); });
        canvas.parentElement.append(gauge, label);
        listenToOrbit(canvas, orbit, drawScene);
        listenToNames(canvas, label, () => shown ?? [{ picture: { bodies: [] }, discs: [], lines: [] }, [], { width: 1, height: 1, scale: 1, right: [1, 0, 0], up: [0, 1, 0], out: [0, 0, 1], hidden }]);
        canvas.addEventListener("keydown", (event) => {
            if (event.key !== " ") return;
            event.preventDefault();
            play(!plays);
        });
        byId("play").addEventListener("click", () => play(!plays));
        byId("time").addEventListener("input", () => {
            play(false);
            if (scene) goTo(span()[0] + (Number(byId("time").value) / 1000) * (span()[1] - span()[0]));
        });
        new ResizeObserver(draw).observe(canvas);
        new ResizeObserver(draw).observe(byId("curves"));
        dark.addEventListener("change", () => {
            if (!scene) return;
            view = canvasView(canvas, scene);
            renewNames();
            draw();
        });
        play(plays);
    };

    /* The module, behind all that the page shows without it. */
    const load = () => new Promise((resolve, reject) => {
        const script = element("script");
        Object.assign(script, { src: "kempe_page.js", onload: () => resolve(Kempe.start()), onerror: () => reject(new Error("the file kempe_page.js is missing in the folder of the page")) });
        document.body.append(script);
    });
    const stayAsGiven = () => {
        document.querySelectorAll("#sliders input, #reset").forEach((part) => (part.disabled = true));
        text.readOnly = true;
        const reason = "this browser has no WebAssembly, or the file kempe_page.js is missing in the folder of the page.";
        if (scene) byId("took").textContent = `computed when this page was made; a change cannot be computed here: ${reason}`;
        else say("stopped", `The mechanism cannot move here: ${reason}`);
        document.documentElement.dataset.ready = scene ? "yes" : "no";
    };

    begin();
    const given = JSON.parse(byId("first-run").textContent);
    if (given) takeGiven(given);
    else say("begins", "Kempe is starting.");
    requestAnimationFrame(tick);
    requestAnimationFrame(() => setTimeout(async () => {
        if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function") return stayAsGiven();
        try {
            kempe = await load();
        } catch {
            return stayAsGiven();
        }
        document.documentElement.dataset.module = "ready";
        return given && isAsGiven() ? repeat() : run();
    }));
})();
