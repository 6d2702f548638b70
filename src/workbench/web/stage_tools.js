/* SPDX-License-Identifier: BSD-3-Clause */
/* The mouse, a finger and the keyboard in the picture: each turns the view, drags bodies while loops stay closed, picks joints, and
 * draws parts, which change the text of the model. */
"use strict";

const MOVED_PIXELS = 5;
const ROUNDING = 1e-12; /* values below it are shown as 0 */
const GRID_DOTS = 4000; /* at most */
const HINTS = {
    select: "",
    bar: "Bar: press where it begins, and where it ends. In empty space it begins with a pin to the ground.",
    pin: "Pin: press a point or a bar to pin it to the ground; where two bodies meet, to pin them together.",
    point: "Point: press a body, and pull to the place of the point.",
    slider: "Slider: press a point or a bar, and pull in the direction of the guide.",
    spring: "Spring: press where it begins, and where it ends.",
    motor: "Motor: press a joint.",
};
const HINTS_MORE = { drag: "Pull a body to move it, press a joint for its values.", view: "Press a joint for its values; pull to move the view." };

const drawing = { tool: "select", from: null, at: null, cross: null, pointer: "mouse", grip: null, picked: null, dragged: null, moving: null };

/* -- tools -------------------------------------------------------------------------------------------------- */

function chooseTool(tool) {
    Object.assign(drawing, { tool, from: null, at: null, cross: null });
    for (const button of document.querySelectorAll("#tools [data-tool]")) button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    if (tool === "select") delete byId("view").dataset.tool;
    else byId("view").dataset.tool = tool;
    if (tool !== "select") {
        play(false);
        showTime(timeSpan()[0]);
    }
    tellHint();
}

function tellHint(words = "") {
    const empty = !bench.text.trim() && drawing.tool === "select" ? "An empty page: choose Bar and draw the first one, or write a model in the text." : "";
    const usual = drawing.tool === "select" ? empty || (shownScene.m ? HINTS_MORE[bench.engine.drag ? "drag" : "view"] : "") : HINTS[drawing.tool];
    byId("hint").textContent = words || usual;
}

/* A change of the text by the mouse; words say what was done. The view stays as it is. */
function drawn(text, words) {
    shownScene.fitted = true;
    changeText(text);
    tellHint(words);
}

const sizeOfView = () => Math.min(byId("view").clientWidth, byId("view").clientHeight) / frameNow().scale;

/* Each tool acts between two places, or at one of them. */
const ACTIONS = {
    bar(from, to, normal) {
        if (norm(sub(to.world, from.world)) < 0.5 * gridStep()) return tellHint("A bar needs two different places.");
        if (from.body && from.body === to.body) return tellHint(`Both places are on ${from.body}: a bar connects two parts.`);
        const [text, name] = addBar(bench.text, from, to, { normal, angle: (body) => angleOf(body, normal) });
        return drawn(text, `${name} is drawn. The next bar may begin at one of its points.`);
    },
    pin(place, _, normal) {
        if (place.body === "ground") return tellHint("This is a point of the ground already.");
        return drawn(...addPin(bench.text, place, placesAt(place, bench.model), normal));
    },
    point(from, to) {
        if (!from.body || from.body === "ground") return tellHint("A point belongs to a body: press one first.");
        if (to.body === from.body && to.point) return tellHint(`${to.body} has the point ${to.point} there.`);
        const [text, name] = addPoint(bench.text, from.body, localOf(from.body, to.world));
        return drawn(text, `${from.body}.${name} is a point: Coupler curves has its path.`);
    },
    slider(from, to, normal) {
        const pull = sub(to.world, from.world), short = norm(pull) < 0.5 * gridStep(), v = short ? frameNow().right : pull, k = v.reduce((best, x, i) => (Math.abs(x) > Math.abs(v[best]) ? i : best), 0);
        const straight = norm(v.filter((_, i) => i !== k)) < 0.12 * Math.abs(v[k]), axis = straight ? [0, 1, 2].map((i) => (i === k ? 1 : 0)) : v;
        const [text, name] = addSlider(bench.text, from, axis, normal);
        return drawn(text, `${name} moves on a straight guide.`);
    },
    spring(from, to) {
        if (norm(sub(to.world, from.world)) < 0.5 * gridStep()) return tellHint("A spring needs two different places.");
        if ((from.body ?? "ground") === (to.body ?? "ground")) return tellHint("A spring needs places on two bodies.");
        const [text, name] = addSpring(bench.text, from, to);
        return drawn(text, `${name}: its stiffness and free length are in the text.`);
    },
    motor(joint) {
        if (!joint) return tellHint("There is no joint: press the circle of a pin, or a slider.");
        return drawn(...motorOn(joint));
    },
};

/* The drive of a joint. */
const driveOf = ({ name, coordinates }) => bench.model.closures.find((closure) => closure.kind === "drive" && (closure.coordinate === name || coordinates.includes(closure.coordinate)));

/* [text, words] with a motor in a joint. */
function motorOn(joint) {
    const { name, kind, coordinates } = joint, driven = driveOf(joint);
    if (driven) return [bench.text, `${driven.name} drives this joint already.`];
    if (coordinates.length > 1 || (coordinates.length === 0 && !["revolute", "prismatic"].includes(kind))) return [bench.text, `${name} has no single coordinate: a motor needs a pin or a slider.`];
    const coordinate = coordinates[0] ?? name, value = bench.start?.q?.[coordinate] ?? 0;
    const [text, motor] = addMotor(bench.text, coordinate, { value, angle: kind === "R" || kind === "revolute", size: sizeOfView() });
    return [text, `${motor} drives ${name}: its law is in the text.`];
}

const needsTwo = (tool) => ["bar", "point", "slider", "spring"].includes(tool);
const placeNow = (pixel) => (drawing.tool === "motor" ? jointAtPixel(pixel, bench.model, drawing.pointer) : placeAtPixel(pixel, bench.model, drawing.pointer));

/* A place is set: the first one of a tool, or what completes it. */
function setPlace(pixel) {
    const normal = drawingNormal();
    if (!normal) return tellHint("Parts are drawn along the axes of the ground: press Fit for that view.");
    if (bench.wrong && bench.text.trim()) return tellHint("The text has an error: mend it before drawing.");
    const place = placeNow(pixel);
    if (needsTwo(drawing.tool) && !drawing.from) {
        drawing.from = place;
    } else {
        const [from, to] = needsTwo(drawing.tool) ? [drawing.from, place] : [place, null];
        drawing.from = null;
        ACTIONS[drawing.tool](from, to, normal);
    }
    return drawScene();
}

/* Dots on the grid while a tool is chosen, each fifth line of it. */
function gridDots(see, frame) {
    const normal = drawingNormal(), step = 5 * gridStep(), pixels = step * frame.scale, [columns, rows] = [frame.width, frame.height].map((size) => Math.ceil(size / pixels) + 1);
    if (drawing.tool === "select" || !normal || columns * rows > GRID_DOTS) return [];
    const corner = worldAt([0, frame.height]).map((x) => Math.floor(x / step) * step), [x, y] = see(corner), dots = [];
    for (let i = 0; i <= columns; i++) for (let j = 0; j <= rows; j++) dots.push(`M${(x + i * pixels).toFixed(1)},${(y - j * pixels).toFixed(1)}h0`);
    return [drawn2d("path", { d: dots.join(""), stroke: lineColour(), "stroke-width": 2.5, "stroke-linecap": "round", class: "grid" })];
}

/* The cross and the line of a tool, and the chosen joint. */
function drawTools(see, frame) {
    const parts = gridDots(see, frame), colour = styleOf("--accent"), around = (p, r, more) => {
        const [cx, cy] = see(p);
        parts.push(drawn2d("circle", { cx, cy, r, fill: "none", stroke: colour, "stroke-width": 2, ...more }));
    };
    const origin = drawing.tool !== "select" && !shownScene.m ? [[0, 0, 0]] : [], points = drawing.tool === "select" && shownScene.m ? [] : modelPlaces(bench.model);
    for (const p of origin) parts.push(...["M-9,0H9", "M0,-9V9"].map((d) => drawn2d("path", { d, stroke: softColour(), transform: `translate(${see(p)})` })));
    for (const { world, body } of points) {
        if (body === "ground") parts.push(drawn2d("path", { d: "M0,2L8,15H-8Z", fill: groundColour(), transform: `translate(${see(world)})` }));
        around(world, 4, { stroke: softColour(), "stroke-width": 1.5 });
    }
    if (drawing.picked) {
        const joint = modelJoints(bench.model).find(({ name }) => name === drawing.picked);
        if (joint) around(joint.world, 11, { "stroke-dasharray": "5 3" });
    }
    if (drawing.from) {
        around(drawing.from.world, 6);
        const end = drawing.at ? see(drawing.at.world) : see(drawing.from.world);
        parts.push(drawn2d("path", { d: `M${see(drawing.from.world)}L${end}`, stroke: colour, "stroke-width": drawing.tool === "bar" ? 5 : 2, "stroke-linecap": "round", opacity: 0.6, ...(drawing.tool === "bar" ? {} : { "stroke-dasharray": "6 4" }) }));
    }
    if (drawing.at && drawing.tool !== "select") {
        around(drawing.at.world, drawing.at.body || drawing.at.name ? 9 : 4, { "data-at": drawing.at.body ?? "" });
        const words = drawing.at.name ?? (drawing.at.body ? [drawing.at.body, drawing.at.point].filter(Boolean).join(".") : drawing.at.world.filter((_, k) => "xyz"[k] !== drawingNormal()).map((x) => plain(x)).join(", "));
        const [x, y] = see(drawing.at.world);
        parts.push(label2d(words, Math.min(x + 12, frame.width - 90), y - 10, "start", { class: "on-picture", fill: inkColour(), "font-size": 12 }));
    }
    if (drawing.moving) {
        around(drawing.moving.world, 7);
        parts.push(drawn2d("path", { d: `M${see(drawing.moving.from)}L${see(drawing.moving.world)}`, stroke: colour, "stroke-width": 1.5, "stroke-dasharray": "4 3" }));
    }
    if (drawing.dragged) parts.push(drawn2d("path", { d: `M${see(drawing.dragged.at)}L${see(drawing.dragged.target)}`, stroke: colour, "stroke-width": 1.5, "stroke-dasharray": "4 3" }));
    return parts;
}

/* -- dragging a body ---------------------------------------------------------------------------------------- */

/* One request at a time; the last target of the pointer follows. */
async function pull(target) {
    const held = drawing.dragged;
    held.target = target;
    if (held.busy) return;
    held.busy = true;
    try {
        for (let asked = null, before = Infinity, nearer = true; drawing.dragged === held && (asked !== held.target || nearer); ) {
            if (asked !== held.target) before = Infinity;
            asked = held.target;
            const known = bench.dragText === bench.text;
            const told = await bench.engine.drag({ session: known ? bench.dragSession : null, text: known ? null : bench.text, q: held.q, body: held.body, point: held.point, target: asked });
            Object.assign(bench, { dragSession: told.session, dragText: bench.text });
            Object.assign(held, { q: told.q, moved: true });
            showPoses(told.poses);
            held.at = moved(poseOf(held.body), held.point);
            drawScene();
            byId("view").dataset.closure = told.closure;
            nearer = told.distance > 1e-6 && told.distance < 0.98 * before;
            before = told.distance;
        }
    } catch (error) {
        bench.dragText = null;
        tellHint(sentence(error.message));
        drawing.dragged = null;
    }
    held.busy = false;
    if (held.released) endDrag(held);
}

function beginDrag(place) {
    if (!bench.engine.drag || !bench.model || bench.wrong || !place.body || place.body === "ground") return false;
    play(false);
    drawing.dragged = { body: place.body, point: place.local, at: place.world, target: place.world, q: shownScene.posed ? bench.dragQ ?? null : null, busy: false, moved: false };
    return true;
}

/* The values of the dragged state may become the start of the model. */
function endDrag(held) {
    if (held.busy) {
        held.released = true;
        return;
    }
    if (drawing.dragged === held) drawing.dragged = null;
    if (!held.moved) return;
    bench.dragQ = held.q;
    drawing.picked = null;
    const keep = element("button", "Use as start");
    keep.type = "button";
    keep.id = "keep-start";
    keep.addEventListener("click", () => {
        const angles = new Set(coordinateList().filter(({ angle }) => angle).map(({ name }) => name));
        drawn(setStart(bench.text, Object.fromEntries(Object.entries(held.q).map(([name, value]) => [name, { value, angle: angles.has(name) }]))), "The start of the model is where the bodies are.");
        byId("picked").hidden = true;
    });
    showCard("Dragged", Object.entries(held.q).slice(0, 8).map(([name, value]) => [name, ...coordinateWords(name, value)]), [keep]);
    drawScene();
}

/* -- what was picked ---------------------------------------------------------------------------------------- */

function showCard(title, rows, buttons) {
    const table = element("table", ...rows.map((cells) => rowOf(...cells))), close = element("button", "Close");
    close.type = "button";
    close.addEventListener("click", () => pick(null));
    delete byId("picked").dataset.joint;
    byId("picked").replaceChildren(element("strong", title), table, ...buttons, close);
    byId("picked").hidden = false;
}

/* [number, unit] of a coordinate, angles in degrees. */
function coordinateWords(name, value) {
    const { angle } = coordinateList().find((one) => one.name === name) || { angle: true };
    return [digits(angle ? degrees(value) : value, 4), angle ? "deg" : "m"];
}

/* The values of a joint at the time that is shown. */
function jointRows({ name, coordinates }) {
    const { run } = bench, t = shownScene.t, shown = run && run.page.picture === shownScene.picture && !shownScene.posed;
    const valueOf = (column) => (shown && run.column(column) ? [[valueAtTime(run, column, t), run.column(column).unit]] : []), shownDigits = (x) => digits(Math.abs(x) < ROUNDING ? 0 : x, 5);
    const rows = (coordinates.length ? coordinates : [name]).flatMap((c) => [["position", `q.${c}`], ["velocity", `qd.${c}`], ["acceleration", `qdd.${c}`]].flatMap(([words, column]) => valueOf(column).map(([x, unit]) => [words, shownDigits(x), unit])));
    const row = shown && forces?.rows.find((one) => one.name === name && one.kind === "joints");
    if (row) rows.push(["force", digits(norm(forceAt(row, shownScene.poses, t)[0]), 5), forces.unit]);
    if (!shown && bench.start) for (const c of coordinates) if (isNumber(bench.start.q[c])) rows.push(["at the start", ...coordinateWords(c, bench.start.q[c])]);
    const least = shown && run.page.reactions?.rows.find(([joint]) => joint === name);
    if (least && isNumber(least[2])) rows.push(["largest force", digits(least[2], 5), `N at ${three(least[3])} s`]);
    return rows;
}

function pick(name) {
    drawing.picked = name;
    delete byId("picked").dataset.joint;
    byId("picked").hidden = !name;
    tellPicked();
    drawScene();
}

/* While the picture moves only the numbers are written again, so that buttons stay where they are pressed. */
function tellPicked() {
    const joint = drawing.picked && modelJoints(bench.model).find(({ name }) => name === drawing.picked), card = byId("picked");
    if (!joint) {
        if (drawing.picked) pick(null);
        return;
    }
    if (card.dataset.joint === joint.name && !card.hidden) return card.querySelector("table").replaceChildren(...jointRows(joint).map((cells) => rowOf(...cells)));
    const motor = element("button", "Add a motor");
    motor.type = "button";
    motor.addEventListener("click", () => drawn(...motorOn(joint)));
    const may = !bench.wrong && !driveOf(joint) && joint.coordinates.length <= 1 && (joint.coordinates.length === 1 || ["revolute", "prismatic"].includes(joint.kind));
    showCard(`${joint.name}: ${joint.bodies.join(", ")}`, jointRows(joint), may ? [motor] : []);
    card.dataset.joint = joint.name;
    return undefined;
}

/* -- pins of the ground ------------------------------------------------------------------------------------- */

/* The point of the ground at a place, if the text has its numbers. */
function groundPinAt({ world }) {
    const pin = modelPlaces(bench.model).find(({ body, point, world: at }) => body === "ground" && point && norm(sub(at, world)) < 1e-6);
    return pin && !bench.wrong && drawingNormal() && movePoint(bench.text, pin.point, pin.world) !== null ? pin : null;
}

/* A pin that was pulled has another place in the text; the loops close from there. */
function setPin({ point, world }) {
    drawn(movePoint(bench.text, point, world), `ground.${point} is at ${world.map((x) => plain(x)).join(", ")} m.`);
    drawScene();
}

/* -- the pointer -------------------------------------------------------------------------------------------- */

const fingers = new Map();

function pixelOf(event) {
    const box = byId("view").getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
}

function turnView(dx, dy) {
    const { camera } = shownScene;
    camera.yaw -= 0.008 * dx;
    camera.pitch = Math.min(Math.max(camera.pitch + 0.008 * dy, -1.55), 1.55);
}

function shiftView(dx, dy) {
    const { camera } = shownScene, frame = frameNow();
    camera.centre = add(camera.centre, add(scaled(-dx / frame.scale, frame.right), scaled(dy / frame.scale, frame.up)));
}

/* The place below the pixel stays where it is. */
function zoomView(factor, pixel) {
    const { camera } = shownScene, before = worldAt(pixel);
    camera.scale = Math.min(Math.max((camera.scale || 400) * factor, 1e-3), 1e7);
    camera.centre = add(camera.centre, sub(before, worldAt(pixel)));
}

function pressed(event) {
    const pixel = pixelOf(event);
    byId("view").setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, pixel);
    drawing.pointer = event.pointerType || "mouse";
    if (fingers.size === 2) {
        Object.assign(drawing, { grip: { pinch: true }, from: null, dragged: null, moving: null });
        return;
    }
    drawing.grip = { from: pixel, last: pixel, moved: false, begun: Boolean(drawing.from), turns: event.shiftKey || event.button === 2 };
    if (drawing.tool !== "select") {
        if (!drawing.from && needsTwo(drawing.tool)) setPlace(pixel);
        return;
    }
    const place = placeAtPixel(pixel, bench.model, drawing.pointer);
    if (!drawing.grip.turns && place.body) Object.assign(drawing.grip, { place, pin: groundPinAt(place) });
}

function pinched(event, pixel) {
    const [[, other]] = [...fingers].filter(([id]) => id !== event.pointerId), before = fingers.get(event.pointerId), away = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    fingers.set(event.pointerId, pixel);
    zoomView(away(pixel, other) / (away(before, other) || 1), [0, 1].map((k) => (pixel[k] + other[k]) / 2));
    shiftView((pixel[0] - before[0]) / 2, (pixel[1] - before[1]) / 2);
    drawScene();
}

function pointed(event) {
    const pixel = pixelOf(event), { grip } = drawing;
    if (fingers.size === 2 && fingers.has(event.pointerId)) return pinched(event, pixel);
    if (drawing.tool !== "select") {
        drawing.at = placeNow(pixel);
        if (grip && Math.hypot(pixel[0] - grip.from[0], pixel[1] - grip.from[1]) > 2 * MOVED_PIXELS) grip.moved = true;
        return drawScene();
    }
    if (!grip || grip.pinch) return undefined;
    if (Math.hypot(pixel[0] - grip.from[0], pixel[1] - grip.from[1]) > MOVED_PIXELS && !grip.moved) {
        grip.moved = true;
        if (grip.pin) drawing.moving = { point: grip.pin.point, from: grip.pin.world, world: grip.pin.world };
        else if (grip.place) beginDrag(grip.place);
    }
    if (!grip.moved) return undefined;
    const [dx, dy] = [pixel[0] - grip.last[0], pixel[1] - grip.last[1]];
    grip.last = pixel;
    if (drawing.dragged) return void pull(worldAt(pixel, drawing.dragged.at));
    if (drawing.moving) {
        drawing.moving.world = snapped(worldAt(pixel, drawing.moving.from));
        return drawScene();
    }
    if (grip.turns || !shownScene.basis.planar) turnView(dx, dy);
    else shiftView(dx, dy);
    return drawScene();
}

function released(event) {
    const pixel = pixelOf(event), { grip } = drawing;
    fingers.delete(event.pointerId);
    if (fingers.size === 0) drawing.grip = null;
    if (!grip || grip.pinch) return;
    if (drawing.tool !== "select") {
        if (!needsTwo(drawing.tool) || (drawing.from && (grip.begun || grip.moved))) setPlace(pixel);
        return;
    }
    const { moving } = drawing;
    drawing.moving = null;
    if (moving) setPin(moving);
    else if (drawing.dragged) endDrag(drawing.dragged);
    else if (!grip.moved) pick(jointAtPixel(pixel, bench.model, drawing.pointer)?.name ?? null);
}

/* -- the keyboard ------------------------------------------------------------------------------------------- */

const TOOL_KEYS = { s: "select", b: "bar", p: "pin", t: "point", l: "slider", k: "spring", m: "motor" };
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/* The cross of a tool moves by the grid. */
function moveCross([x, y], far) {
    const frame = frameNow(), step = Math.max(gridStep() * frame.scale, 4) * (far ? 5 : 1), [cx, cy] = drawing.cross || [frame.width / 2, frame.height / 2];
    drawing.cross = [Math.min(Math.max(cx + x * step, 4), frame.width - 4), Math.min(Math.max(cy + y * step, 4), frame.height - 4)];
    drawing.at = placeNow(drawing.cross);
    if (drawing.at && !drawing.at.body && !drawing.at.name) drawing.cross = seeNow()(drawing.at.world);
    drawScene();
}

/* Joints one after another. */
function pickNext(back) {
    const names = modelJoints(bench.model).map(({ name }) => name), at = names.indexOf(drawing.picked);
    if (names.length > 0) pick(names[(at + (back ? -1 : 1) + names.length + (at < 0 && back ? 1 : 0)) % names.length]);
}

function typed(event) {
    const arrow = ARROWS[event.key], { camera } = shownScene, middle = [byId("view").clientWidth / 2, byId("view").clientHeight / 2];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const done = () => event.preventDefault();
    if (arrow && drawing.tool !== "select") moveCross(arrow, event.shiftKey);
    else if (arrow && shownScene.basis.planar && !event.shiftKey) shiftView(-40 * arrow[0], -40 * arrow[1]);
    else if (arrow) turnView(-12 * arrow[0], 12 * arrow[1]);
    else if (event.key === "Enter" && drawing.tool !== "select") setPlace(drawing.cross || middle);
    else if (event.key === "Escape") {
        if (drawing.from) drawing.from = null;
        else chooseTool("select");
        pick(null);
    } else if (event.key === " ") play(!shownScene.playing);
    else if (event.key === "+" || event.key === "-") zoomView(event.key === "+" ? 1.2 : 1 / 1.2, middle);
    else if (event.key === "j" || event.key === "J") pickNext(event.key === "J");
    else if (event.key === "f") fitScene();
    else if (TOOL_KEYS[event.key]) chooseTool(TOOL_KEYS[event.key]);
    else return;
    done();
    if (camera) drawScene();
}

function beginTools() {
    const canvas = byId("view");
    for (const button of document.querySelectorAll("#tools [data-tool]")) button.addEventListener("click", () => chooseTool(button.dataset.tool));
    for (const [kind, listen] of Object.entries({ pointerdown: pressed, pointermove: pointed, pointerup: released })) canvas.addEventListener(kind, listen);
    canvas.addEventListener("pointercancel", (event) => {
        fingers.delete(event.pointerId);
        Object.assign(drawing, { grip: null, dragged: null, moving: null });
    });
    canvas.addEventListener("pointerleave", () => {
        if (drawing.grip) return;
        drawing.at = null;
        drawScene();
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        zoomView(Math.exp(-0.0012 * event.deltaY), pixelOf(event));
        drawScene();
    }, { passive: false });
    canvas.addEventListener("keydown", typed);
    shownScene.over.push(drawTools);
    byId("fit").addEventListener("click", () => {
        fitScene();
        drawScene();
    });
    chooseTool("select");
}
