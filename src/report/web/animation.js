/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving picture: by three.js, or on a plain canvas where there is no WebGL; playing, and turning with the mouse. */
"use strict";

const PLAY_SECONDS = 10;
const STOP_COLOUR = "#e11d1d";

/* Colours of bodies are those of their curves; bodies beyond these colours have light lines across them, or crossed ones. */
const HATCHES = ["", "hatched", "crossed"];
const bodyColour = (b) => (b > 0 ? curveColour(b - 1) : groundColour());
const hatchOf = (b) => (b > 0 ? HATCHES[Math.floor((b - 1) / COLOURS.length) % HATCHES.length] : "");
const pinColour = () => (isDark() ? "#dfe6e9" : "#2c3437");
const tyreColour = () => (isDark() ? "#565d61" : "#33383b");
const ropeColour = () => (isDark() ? "#c9a56b" : "#8a6326");
const groundColour = () => (isDark() ? "#7f8c92" : "#8a949a");

/* -- the stage ---------------------------------------------------------------------------------------------- */

/* A note, and what of many bodies and of large meshes is drawn. */
function writeNote(picture, note) {
    /*FLEXIBLE*/ note = [note, deformationNote(picture)].filter(Boolean).join(" ");
    /*FLEXIBLE*/ picture = withoutPlaces(picture);
    const drawn = picture.bodies.length - 1, bodies = drawn < picture.of_bodies ? `${drawn} of ${picture.of_bodies} bodies are drawn.` : "";
    const thinned = picture.meshes.filter((mesh) => mesh.drawn < mesh.triangles);
    const sum = (key) => thinned.reduce((all, mesh) => all + mesh[key], 0);
    const meshes = thinned.length === 0 ? "" : `${thinned.length === 1 ? `${thinned[0].file} is` : `${thinned.length} meshes are`} drawn by ${sum("drawn")} triangles for ${sum("triangles")}.`;
    byId("stage-note").textContent = [note, bodies, meshes].filter(Boolean).join(" ");
}

/* More bodies than these are listed by groups, which are open at first up to so many. */
const FEW_BODIES = 12, OPEN_BODIES = 30, turnedGroups = new Set();

/* Bodies by the first word of their names, if several begin with it; the others under "". */
function groupsOf(bodies) {
    const word = ({ name }) => name.split(/[_.]/)[0], groups = new Map([["", []]]);
    bodies.forEach((body, b) => {
        const key = b > 0 && bodies.filter((other, k) => k > 0 && word(other) === word(body)).length > 1 ? word(body) : "";
        if (b > 0) groups.set(key, [...(groups.get(key) || []), b]);
    });
    return groups;
}

/* A button that hides bodies, or shows them; with the shift key it hides all others. */
function switchOf(words, name, own, bodies, hidden, change) {
    const all = bodies.map((_, b) => b).slice(1), alone = all.every((b) => hidden.has(b) !== own.includes(b)), off = own.every((b) => hidden.has(b));
    const made = buttonOf(words, !off, (event) => {
        if (event.shiftKey) for (const b of all) hidden[own.includes(b) || alone ? "delete" : "add"](b);
        else for (const b of own) hidden[off ? "delete" : "add"](b);
        change();
    });
    made.title = `${off ? "Show" : "Hide"} ${name}; with the shift key: ${alone ? "show all" : `show only ${name}`}`;
    return made;
}

/* The colour of a body among the names: of a solid with a colour, otherwise of its curves. */
const solidWithColour = ({ solids }) => solids.find((part) => part.colour && !part.hole);
const namedColour = (body, b) => (solidWithColour(body) || { colour: bodyColour(b) }).colour;

/* A legend of the bodies' colours, whose names switch them off and on. */
function writeNames(bodies, hidden, change) {
    /*FLEXIBLE*/ bodies = withoutPlaces({ bodies }).bodies;
    const count = bodies.length - 1, names = bodies.map((body, b) => {
        const mark = swatchOf(namedColour(body, b)), hatch = hatchOf(b);
        if (!solidWithColour(body) && hatch) mark.classList.add(hatch);
        return switchOf([mark, body.name], body.name, [b], bodies, hidden, change);
    });
    if (count <= FEW_BODIES) return byId("names").replaceChildren(...names.slice(1));
    return byId("names").replaceChildren(...[...groupsOf(bodies)].flatMap(([key, own]) => {
        const list = own.map((b) => names[b]);
        if (!key) return list;
        const group = element("details", element("summary", `${key} (${own.length})`), switchOf("all", `all of ${key}`, own, bodies, hidden, change), ...list);
        group.open = count <= OPEN_BODIES !== turnedGroups.has(key);
        group.firstChild.addEventListener("click", () => turnedGroups.delete(key) || turnedGroups.add(key));
        return group;
    }));
}

/* -- over the picture --------------------------------------------------------------------------------------- */

/* The place of a point in the view, in pixels. */
function projection(m, poses, view) {
    const from = m.centreAt(poses);
    return (p) => [view.width / 2 + view.scale * dot(sub(p, from), view.right), view.height / 2 - view.scale * dot(sub(p, from), view.up)];
}

/* An arrow from a place along a direction of the model as it is seen, with a letter at its tip; a dot where it points at
 * the viewer. `bold`: times the usual width; `head`: times the usual size of the tip; more attributes of the line. */
function arrow([x, y], direction, view, length, colour, name, { bold = 1, head = bold, ...more } = {}) {
    const dx = length * dot(direction, view.right), dy = -length * dot(direction, view.up), long = Math.hypot(dx, dy);
    if (long < 3) return [drawn2d("circle", { cx: x, cy: y, r: 2.5 * bold, fill: colour, ...more })];
    const [ux, uy] = [dx / long, dy / long], tip = [x + dx, y + dy];
    const barbs = [[-ux - 0.6 * uy, -uy + 0.6 * ux], [-ux + 0.6 * uy, -uy - 0.6 * ux]].map(([a, b]) => `${tip[0] + 5 * head * a},${tip[1] + 5 * head * b}`);
    return [
        drawn2d("path", { d: `M${x},${y}L${tip}M${barbs[0]}L${tip}L${barbs[1]}`, stroke: colour, "stroke-width": 1.6 * bold, fill: "none", ...more }),
        label2d(name, tip[0] + 8 * ux, tip[1] + 8 * uy + 4, "middle", { class: "on-picture", fill: colour, "font-size": 11 }),
    ];
}

/* A length of 1, 2 or 5 times a power of ten that fits into so many pixels. */
function evenLength(most) {
    const power10 = 10 ** Math.floor(Math.log10(most));
    return power10 * [5, 2, 1].find((part) => part * power10 <= most);
}

/* The unit that the page shows lengths in, and how many of it a metre is. */
const lengthUnit = () => data.length || { unit: "m", factor: 1 };

function lengthWords(metres) {
    const { unit: own, factor } = lengthUnit();
    if (own !== "m") return `${three(factor * metres)} ${own}`;
    return metres >= 1000 ? `${three(metres / 1000)} km` : metres >= 1 ? `${three(metres)} m` : metres >= 1e-3 ? `${three(1000 * metres)} mm` : `${three(1e6 * metres)} \u00b5m`;
}

/* Axes of the ground, direction of gravity, and a scale. */
function drawGauge(gauge, m, view) {
    const ink = softColour(), low = view.height - 26, { factor } = lengthUnit(), length = evenLength((90 * factor) / view.scale) / factor, wide = length * view.scale, right = view.width - 10;
    const parts = [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]].flatMap(([name, axis]) => arrow([34, low], axis, view, 20, ink, name));
    if (norm(m.picture.gravity) > 0) parts.push(...arrow([92, low - 20], unit(m.picture.gravity), view, 22, ink, "g"));
    parts.push(drawn2d("path", { d: `M${right - wide},${low + 8}v6h${wide}v-6`, stroke: ink, "stroke-width": 1.4, fill: "none" }));
    parts.push(label2d(lengthWords(length), right - wide / 2, low + 6, "middle", { fill: ink, "font-size": 11 }));
    /*FLEXIBLE*/ parts.push(label2d(deformationWords(m.picture), 12, 20, "start", { fill: ink, "font-size": 12, id: "deformed" }));
    /*FLEXIBLE*/ parts.push(...stressScale(m.picture, ink));
    gauge.replaceChildren(...parts);
    gauge.dataset.scale = lengthWords(length);
}

function distanceTo([x, y], [ax, ay], [bx, by]) {
    const l = (bx - ax) ** 2 + (by - ay) ** 2, s = l > 0 ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / l, 0), 1) : 0;
    return Math.hypot(x - ax - s * (bx - ax), y - ay - s * (by - ay));
}

/* The name of what is nearest to a place of the view: a joint or point, else a body; "" where nothing is near. */
function nameAt(place, m, poses, view) {
    const see = projection(m, poses, view), near = 10, depth = (p) => dot(p, view.out);
    let best = near, name = "", front = -Infinity;
    const offer = (distance, words) => {
        if (distance < best) [best, name] = [distance, words];
    };
    m.picture.bodies.forEach((body, b) => {
        if (view.hidden.has(b)) return;
        for (const p of body.points) if (p[4]) offer(Math.hypot(...see(moved(poses[b], p.slice(0, 3))).map((x, k) => x - place[k])) - 2, `${body.name}: ${p[4]}`);
        const shape = m.shapes[b], world = shape.points.map((p) => see(moved(poses[b], p)));
        if (b > 0) for (const [i, j] of shape.bars) offer(distanceTo(place, world[i], world[j]), body.name);
    });
    m.picture.bodies.forEach((body, b) => {
        for (const part of view.hidden.has(b) || best < near - 3 ? [] : m.shapes[b].solids) {
            const [world, away] = [see, depth].map((look) => (p) => look(moved(poses[b], p))), over = coverAt(part, place, world, away);
            if (over > front) [front, name] = [over, body.name];
        }
    });
    for (const disc of m.discs) if (!view.hidden.has(disc.body)) offer(Math.hypot(...see(moved(poses[disc.body], disc.at)).map((x, k) => x - place[k])), m.picture.bodies[disc.body].name);
    for (const line of m.lines) offer(distanceTo(place, ...[0, 1].map((k) => see(moved(poses[line.body[k]], line.at[k])))), line.name);
    return name;
}

/* Shows that name next to the pointer; `now` gives the state of the picture. */
function listenToNames(canvas, label, now) {
    canvas.addEventListener("pointermove", (event) => {
        const box = canvas.getBoundingClientRect(), place = [event.clientX - box.left, event.clientY - box.top];
        label.textContent = event.buttons ? "" : nameAt(place, ...now());
        label.style.left = `${Math.min(place[0] + 12, box.width - 120)}px`;
        label.style.top = `${place[1] + 12}px`;
    });
    canvas.addEventListener("pointerleave", () => (label.textContent = ""));
}

/* Turning and zooming by mouse, touch and keys; `change` is called after each. */
function listenToOrbit(canvas, orbit, change) {
    let grip = null;
    canvas.addEventListener("pointerdown", (event) => {
        grip = [event.clientX, event.clientY];
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
        if (!grip) return;
        orbit.yaw -= 0.008 * (event.clientX - grip[0]);
        orbit.pitch = Math.min(Math.max(orbit.pitch + 0.008 * (event.clientY - grip[1]), -1.55), 1.55);
        grip = [event.clientX, event.clientY];
        change();
    });
    const release = () => (grip = null);
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("wheel", (event) => {
        if (document.activeElement !== canvas) return; /* the page scrolls until the picture was clicked */
        event.preventDefault();
        orbit.zoom = Math.min(Math.max(orbit.zoom * Math.exp(-0.0012 * event.deltaY), 0.2), 20);
        change();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => {
        Object.assign(orbit, orbit.home, { zoom: 1 });
        change();
    });
    canvas.addEventListener("keydown", (event) => {
        const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
        if (!turns) return;
        event.preventDefault();
        orbit.yaw += turns[0];
        orbit.pitch = Math.min(Math.max(orbit.pitch + turns[1], -1.55), 1.55);
        change();
    });
}

/* As many decimals as distinguish frames. */
function clockOf(t, t_end, unit = "s") {
    const places = Math.min(Math.max(3 - Math.floor(Math.log10(t_end || 1)), 0), 12);
    return `${t.toFixed(places)} ${unit}`.trim();
}

/* `ask`: span() is the played part of the frames' time and seconds() its duration; note(picture), clock(t) and shown(t)
 * give the texts under the picture; over(mechanism, poses, view, time) lists what is drawn over it. */
function beginStage(picture, ask) {
    const canvas = byId("view");
    if (!picture) {
        byId("stage-note").textContent = "There is no run to animate.";
        byId("play").parentElement.hidden = true;
        canvas.parentElement.hidden = true;
        return null;
    }
    const m = makeMechanism(picture), orbit = { ...m.home, home: m.home, zoom: 1 };
    const view = hasWebGL() ? glView(canvas, m) : canvasView(canvas, m);
    const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const length = () => ask.span()[1] - ask.span()[0];
    const hidden = new Set(), gauge = drawn2d("svg", { class: "gauge", "aria-hidden": "true" }), label = element("span.label-at");
    let t = 0, playing = false, last = 0, shown = null;
    canvas.parentElement.append(gauge, label);

    function draw() {
        const width = Math.max(canvas.clientWidth, 50), height = Math.max(canvas.clientHeight, 50);
        const room = 1.12, border = 9 * m.thick;
        const scale = orbit.zoom * Math.min(width / (2 * (room * m.extent.width + border)), height / (2 * (room * m.extent.height + border)));
        shown = [m, m.motion(ask.span()[0] + t), { width, height, scale, hidden, ...turnedBasis(m.basis, orbit.yaw, orbit.pitch) }];
        view.draw(...shown.slice(1));
        gauge.setAttribute("viewBox", `0 0 ${width} ${height}`); /* on paper both are smaller */
        drawGauge(gauge, m, shown[2]);
        if (ask.over) gauge.append(...ask.over(...shown, ask.span()[0] + t));
        byId("clock").textContent = ask.clock(t);
        ask.shown(t);
    }

    function step(now) {
        if (!playing) return;
        const t_end = length();
        t += ((now - last) / 1000) * (t_end / ask.seconds());
        if (t > t_end) t = t_end > 0 ? t % t_end : 0;
        last = now;
        byId("time").value = String(Math.round((1000 * t) / (t_end || 1)));
        draw();
        requestAnimationFrame(step);
    }

    function play(on) {
        const before = playing;
        playing = on && length() > 0;
        byId("play").textContent = playing ? "\u275a\u275a" : "\u25b6";
        last = performance.now();
        if (playing && !before) requestAnimationFrame(step);
    }

    function renew() {
        /*FLEXIBLE*/ hidePlaces(picture, hidden);
        writeNames(picture.bodies, hidden, renew);
        draw();
    }

    /* Shows a time, and does not go on. */
    function seek(time) {
        play(false);
        t = Math.min(Math.max(time - ask.span()[0], 0), length());
        byId("time").value = String(Math.round((1000 * t) / (length() || 1)));
        draw();
    }

    listenToOrbit(canvas, orbit, draw);
    listenToNames(canvas, label, () => shown);
    byId("play").addEventListener("click", () => play(!playing));
    canvas.addEventListener("keydown", (event) => {
        if (event.key !== " ") return;
        event.preventDefault();
        play(!playing);
    });
    byId("time").addEventListener("input", () => {
        play(false);
        t = (length() * Number(byId("time").value)) / 1000;
        draw();
    });
    new ResizeObserver(draw).observe(canvas);
    writeNote(picture, ask.note(picture));
    writeNames(picture.bodies, hidden, renew);
    /*FLEXIBLE*/ beginDeformation(m, view.rebuild, draw);
    byId("play").parentElement.hidden = !(length() > 0);
    beginViews(canvas, gauge, { orbit, draw, length, seconds: ask.seconds, show: (time) => seek(ask.span()[0] + time) });
    canvas.dataset.frames = picture.frames.count;
    canvas.dataset.bodies = picture.bodies.length;
    canvas.dataset.view = view.kind;
    canvas.dataset.follows = String(m.follows);
    canvas.dataset.planar = String(m.basis.planar);
    draw();
    play(!calm);
    return {
        redraw: draw,
        recolour() {
            view.rebuild();
            renew();
        },
        seek,
        /* Another span: from its beginning. */
        restart() {
            t = 0;
            writeNote(picture, ask.note(picture));
            draw();
            play(!calm);
        },
    };
}
