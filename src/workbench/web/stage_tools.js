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
    delete: "Delete: press a body, a joint or a spring.",
};
const HINTS_MORE = { drag: "Pull a body to move it, press a joint for its values.", view: "Press a joint for its values; pull to move the view." };
const CHANGED_MODE = "The mechanism is in another assembly mode now";
const PREPARED_AFTER = 300; /* ms until a drag that does not begin is said to be prepared */

/* picked: { kind, name } of a joint, body or force; grabbed: true while the arrow keys drag */
const drawing = { tool: "select", from: null, at: null, cross: null, pointer: "mouse", grip: null, picked: null, dragged: null, moving: null, grabbed: false };

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
    writeHint();
}

function writeHint(words = "") {
    const empty = !bench.text.trim() && drawing.tool === "select" ? "An empty page: choose Bar and draw the first one, or write a model in the text." : "";
    const usual = drawing.tool === "select" ? empty || (shownScene.m ? HINTS_MORE[bench.engine.drag ? "drag" : "view"] : "") : HINTS[drawing.tool];
    byId("hint").textContent = words || usual;
}

/* A change of the text by the mouse; words say what was done. The view stays as it is. */
function drawn(text, words) {
    shownScene.fitted = true;
    changeText(text);
    writeHint(words);
}

const sizeOfView = () => Math.min(byId("view").clientWidth, byId("view").clientHeight) / frameNow().scale;

/* Each tool acts between two places, or at one of them. */
const ACTIONS = {
    bar(from, to, normal) {
        if (norm(sub(to.world, from.world)) < 0.5 * gridStep()) return writeHint("A bar needs two different places.");
        if (from.body && from.body === to.body) return writeHint(`Both places are on ${from.body}: a bar connects two parts.`);
        const [text, name] = addBar(bench.text, from, to, { normal, angle: (body) => angleOf(body, normal) });
        return drawn(text, `${name} is drawn. The next bar may begin at one of its points.`);
    },
    pin(place, _, normal) {
        if (place.body === "ground") return writeHint("This is a point of the ground already.");
        return drawn(...addPin(bench.text, place, placesAt(place, bench.model), normal));
    },
    point(from, to) {
        if (!from.body || from.body === "ground") return writeHint("A point belongs to a body: press one first.");
        if (to.body === from.body && to.point) return writeHint(`${to.body} has the point ${to.point} there.`);
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
        if (norm(sub(to.world, from.world)) < 0.5 * gridStep()) return writeHint("A spring needs two different places.");
        if ((from.body ?? "ground") === (to.body ?? "ground")) return writeHint("A spring needs places on two bodies.");
        const [text, name] = addSpring(bench.text, from, to);
        return drawn(text, `${name}: its stiffness and free length are in the text.`);
    },
    motor(joint) {
        if (!joint) return writeHint("There is no joint: press the circle of a pin, or a slider.");
        return drawn(...motorOn(joint));
    },
    delete(part) {
        return part ? removed(part) : writeHint("There is no part: press a body, a joint or a spring.");
    },
};

/* The text without a part. */
function removed(part) {
    if (bench.wrong) return writeHint("The text has an error: mend it before deleting a part.");
    const joint = part.kind === "joint" && modelJoints(bench.model).find(({ name }) => name === part.name), body = part.kind === "body" && bench.model.bodies.find(({ name }) => name === part.name);
    const coordinates = joint ? joint.coordinates : body ? body.motions.map(({ coordinate }) => coordinate) : [];
    pick(null);
    return drawn(...removePart(bench.text, { ...part, coordinates }));
}

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
const PARTS_OF_TOOLS = { motor: jointAtPixel, delete: partAtPixel };
const placeNow = (pixel) => (PARTS_OF_TOOLS[drawing.tool] ?? placeAtPixel)(pixel, bench.model, drawing.pointer);

/* A place is set: the first one of a tool, or what completes it. */
function setPlace(pixel) {
    const normal = drawingNormal();
    if (!normal && !PARTS_OF_TOOLS[drawing.tool]) return writeHint("Parts are drawn along the axes of the ground: press Fit for that view.");
    if (bench.wrong && bench.text.trim()) return writeHint("The text has an error: mend it before drawing.");
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
    for (const [part, dashes] of [[drawing.picked, "5 3"], [drawing.tool === "delete" ? drawing.at : null, ""]]) if (part) parts.push(...outlineOf(part, see, { fill: "none", stroke: colour, "stroke-width": 2, "stroke-dasharray": dashes }));
    if (drawing.from) {
        around(drawing.from.world, 6);
        const end = drawing.at ? see(drawing.at.world) : see(drawing.from.world);
        parts.push(drawn2d("path", { d: `M${see(drawing.from.world)}L${end}`, stroke: colour, "stroke-width": drawing.tool === "bar" ? 5 : 2, "stroke-linecap": "round", opacity: 0.6, ...(drawing.tool === "bar" ? {} : { "stroke-dasharray": "6 4" }) }));
    }
    if (drawing.cross && !drawing.at?.world) parts.push(...["M-9,0H9", "M0,-9V9"].map((d) => drawn2d("path", { d, stroke: colour, "stroke-width": 1.5, transform: `translate(${drawing.cross})` })));
    if (drawing.at?.world && drawing.tool !== "select") {
        around(drawing.at.world, drawing.at.body || drawing.at.name ? 9 : 4, { "data-at": drawing.at.body ?? "" });
        const words = drawing.at.name ?? (drawing.at.body ? [drawing.at.body, drawing.at.point].filter(Boolean).join(".") : drawing.at.world.filter((_, k) => "xyz"[k] !== drawingNormal()).map((x) => plain(x)).join(", "));
        const [x, y] = see(drawing.at.world);
        parts.push(label2d(words, Math.min(x + 12, frame.width - 90), y - 10, "start", { class: "on-picture", fill: inkColour(), "font-size": 12 }));
    }
    if (drawing.moving) {
        around(drawing.moving.world, 7);
        parts.push(drawn2d("path", { d: `M${see(drawing.moving.from)}L${see(drawing.moving.world)}`, stroke: colour, "stroke-width": 1.5, "stroke-dasharray": "4 3" }));
    }
    if (drawing.dragged) {
        const { at, target, changes } = drawing.dragged;
        parts.push(drawn2d("path", { d: `M${see(at)}L${see(target)}`, stroke: colour, "stroke-width": 1.5, "stroke-dasharray": "4 3" }));
        around(target, 5);
        if (changes > 0) around(at, 14, { stroke: styleOf("--warn"), "stroke-width": 3 });
    }
    return parts;
}

/* A ring about a joint, a line along a force, rings about the points of a body. */
function outlineOf({ kind, name }, see, look) {
    const ring = (world, r) => {
        const [cx, cy] = see(world);
        return drawn2d("circle", { cx, cy, r, "data-outline": name, ...look });
    };
    if (kind === "joint") return modelJoints(bench.model).filter((joint) => joint.name === name).map(({ world }) => ring(world, 11));
    if (kind === "force") return modelForces(bench.model).filter((force) => force.name === name).map(({ ends: [a, b] }) => drawn2d("path", { d: `M${see(a.world)}L${see(b.world)}`, "data-outline": name, ...look, "stroke-width": 3 }));
    return modelPlaces(bench.model).filter(({ body }) => body === name).map(({ world }) => ring(world, 8));
}

/* -- dragging a body ---------------------------------------------------------------------------------------- */

/* One request at a time; the last target of the pointer follows. */
async function pull(target) {
    const held = drawing.dragged;
    held.target = target;
    if (held.busy) return;
    held.busy = true;
    const late = setTimeout(() => held.moved || writeHint("Preparing the mechanism for dragging: large ones take some seconds."), PREPARED_AFTER);
    try {
        for (let asked = null, before = Infinity, nearer = true; drawing.dragged === held && (asked !== held.target || nearer); ) {
            if (asked !== held.target) before = Infinity;
            asked = held.target;
            const state = stateNow(), known = held.moved && bench.dragState === state; /* included files may have changed since the last drag */
            const reply = await bench.engine.drag({ session: known ? bench.dragSession : null, text: known ? null : bench.text, q: held.q, body: held.body, point: held.point, target: asked });
            Object.assign(bench, { dragSession: reply.session, dragState: state });
            if (!held.moved) writeHint();
            Object.assign(held, { q: reply.q, moved: true, watched: reply.branch_changed !== null, changes: held.changes + Number(reply.branch_changed === true) });
            if (reply.branch_changed) writeHint(`${CHANGED_MODE}.`);
            showPoses(reply.poses);
            held.at = moved(poseOf(held.body), held.point);
            drawScene();
            Object.assign(byId("view").dataset, { closure: reply.closure, changes: held.changes });
            nearer = reply.distance > 1e-6 && reply.distance < 0.98 * before;
            before = reply.distance;
        }
    } catch (error) {
        bench.dragState = null;
        writeHint(sentence(error.message));
        drawing.dragged = null;
        drawing.grabbed = false;
    }
    clearTimeout(late);
    held.busy = false;
    if (held.released) endDrag(held);
}

function beginDrag(place) {
    if (!bench.engine.drag || !bench.model || bench.wrong || !place.body || place.body === "ground") return false;
    play(false);
    drawing.dragged = { body: place.body, point: place.local, at: place.world, target: place.world, q: shownScene.posed ? bench.dragQ ?? null : null, busy: false, moved: false, watched: true, changes: 0 };
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
        drawn(setStart(bench.text, Object.fromEntries(Object.entries(held.q).map(([name, value]) => [name, { value, angle: angles.has(name) }]))), "The model now starts where the bodies are.");
        byId("picked").hidden = true;
    });
    const modes = held.changes > 0 ? `${CHANGED_MODE} than when it was taken${held.changes > 1 ? `, or back: ${held.changes} changes` : ""}.` : held.watched ? "" : "Changes of the assembly mode are not marked in this mechanism: the closures of its loops determine more than 60 coordinates together.";
    showCard("Dragged", Object.entries(held.q).slice(0, 8).map(([name, value]) => [name, ...coordinateWords(name, value)]), [keep], modes);
    moveCardAside(held.at);
    drawScene();
}

/* -- what was picked ---------------------------------------------------------------------------------------- */

function showCard(title, rows, buttons, words = "") {
    const table = element("table", ...rows.map((cells) => rowOf(...cells))), close = element("button", "Close");
    close.type = "button";
    close.addEventListener("click", () => pick(null));
    delete byId("picked").dataset.part;
    byId("picked").replaceChildren(element("strong", title), table, ...(words ? [element("p.warning", words)] : []), ...buttons, close);
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

function bodyRows({ name, mass, points }) {
    return [["mass", digits(mass, 5), "kg"], ["points", Object.keys(points || {}).join(", ") || "\u2013"], ...jointRows(modelJoints(bench.model).find(({ on }) => on === name) || { name, coordinates: [] })].filter(([, value]) => value !== undefined);
}

function forceRows({ ends: [a, b], name }) {
    const given = bench.model.forces.find((force) => force.name === name), row = forces?.rows.find((one) => one.name === name && one.kind === "forces");
    const length = ["length", digits(norm(sub(b.world, a.world)), 5), "m"], known = [["stiffness", "N/m"], ["damping", "N s/m"], ["free_length", "m"]].filter(([key]) => isNumber(given[key])).map(([key, unit]) => [key.replace("_", " "), digits(given[key], 5), unit]);
    return [length, ...known, ...(row && !shownScene.posed ? [["force", digits(norm(forceAt(row, shownScene.poses, shownScene.t)[0]), 5), forces.unit]] : [])];
}

/* The words of the card of a picked part { title, rows, buttons, world }; null: the model has no such part now. */
function cardOf({ kind, name }) {
    if (kind === "body") {
        const body = bench.model?.bodies.find((one) => one.name === name);
        return body ? { title: name, rows: bodyRows(body), buttons: [], world: moved(poseOf(name), body.com || [0, 0, 0]) } : null;
    }
    if (kind === "force") {
        const force = modelForces(bench.model).find((one) => one.name === name);
        return force ? { title: `${name}: ${force.ends.map(({ body, point }) => (point ? `${body}.${point}` : body)).join(", ")}`, rows: forceRows(force), buttons: [], world: force.ends[0].world } : null;
    }
    const joint = modelJoints(bench.model).find((one) => one.name === name);
    if (!joint) return null;
    const driven = driveOf(joint), may = !bench.wrong && !driven && joint.coordinates.length <= 1 && (joint.coordinates.length === 1 || ["revolute", "prismatic"].includes(joint.kind));
    const buttons = may ? [["Add a motor", () => drawn(...motorOn(joint))]] : driven ? [["Delete the motor", () => removed({ kind: "drive", name: driven.name })]] : [];
    return { title: `${joint.name}: ${joint.bodies.join(", ")}`, rows: jointRows(joint), buttons, world: joint.world };
}

/* The card goes to the corner of the picture where it hides least of the mechanism; the place that it describes counts most. */
function moveCardAside(world) {
    const card = byId("picked"), see = seeNow(), { width, height } = frameNow(), room = 16;
    const seen = modelBars(bench.model).flatMap(([a, b]) => [0, 0.25, 0.5, 0.75, 1].map((part) => see(add(scaled(1 - part, a.world), scaled(part, b.world)))));
    const hides = ([right, low]) => ([x, y]) => (right ? width - x : x) < card.offsetWidth + room && (low ? height - y : y) < card.offsetHeight + room + (low ? 0 : 16);
    const corners = [[false, false], [true, false], [false, true], [true, true]].map((corner) => [seen.filter(hides(corner)).length + (world && hides(corner)(see(world)) ? 100 : 0), corner]);
    const [, [right, low]] = corners.reduce((best, one) => (one[0] < best[0] ? one : best));
    card.classList.toggle("right", right);
    card.classList.toggle("low", low);
}

/* A part of the model, by default a joint; null: nothing is picked. */
function pick(name, kind = "joint") {
    drawing.picked = name ? { kind, name } : null;
    drawing.grabbed = false;
    delete byId("picked").dataset.part;
    byId("picked").hidden = !name;
    writePicked();
    drawScene();
}

/* While the picture moves only the numbers are written again, so that buttons stay where they are pressed. */
function writePicked() {
    const { picked } = drawing, card = byId("picked"), reply = picked && cardOf(picked);
    if (!reply) {
        if (picked) pick(null);
        return;
    }
    if (card.dataset.part === picked.name && !card.hidden) return card.querySelector("table").replaceChildren(...reply.rows.map((cells) => rowOf(...cells)));
    const buttons = [...reply.buttons, ["Delete", () => removed(picked)]].map(([words, press]) => {
        const button = element("button", words);
        button.type = "button";
        button.addEventListener("click", press);
        return button;
    });
    showCard(reply.title, reply.rows, buttons);
    moveCardAside(reply.world);
    card.dataset.part = picked.name;
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
    if (drawing.grabbed) endGrab(true);
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
    else if (!grip.moved) {
        const part = partAtPixel(pixel, bench.model, drawing.pointer);
        pick(part?.name ?? null, part?.kind);
    }
}

/* -- the keyboard ------------------------------------------------------------------------------------------- */

const TOOL_KEYS = { s: "select", b: "bar", p: "pin", t: "point", l: "slider", k: "spring", m: "motor", x: "delete" };
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
    pickAfter(modelJoints(bench.model).map(({ name }) => ({ kind: "joint", name })), back);
}

function pickAfter(parts, back) {
    const at = parts.findIndex(({ kind, name }) => kind === drawing.picked?.kind && name === drawing.picked.name);
    if (parts.length === 0) return;
    const { name, kind } = parts[(at + (back ? -1 : 1) + parts.length + (at < 0 && back ? 1 : 0)) % parts.length];
    pick(name, kind);
}

/* Bodies and forces one after another. */
function pickNextPart(back) {
    pickAfter([...(bench.model?.bodies || []).map(({ name }) => ({ kind: "body", name })), ...modelForces(bench.model).map(({ name }) => ({ kind: "force", name }))], back);
}

/* -- dragging by the keyboard ------------------------------------------------------------------------------- */

/* The place by which the arrow keys drag what is picked: a pin of the ground, which moves, or a point of a body. */
function grabbedPlace() {
    const { picked } = drawing, joint = picked?.kind === "joint" && modelJoints(bench.model).find(({ name }) => name === picked.name);
    if (joint) {
        const ground = joint.bodies.includes("ground") && groundPinAt({ world: joint.world });
        return ground ? { pin: ground } : { place: { body: joint.on, local: joint.at, world: joint.world } };
    }
    const body = picked?.kind === "body" && bench.model?.bodies.find(({ name }) => name === picked.name), local = body && (body.com || [0, 0, 0]);
    return body ? { place: { body: picked.name, local, world: moved(poseOf(picked.name), local) } } : null;
}

function grab() {
    const found = grabbedPlace();
    if (!found) return writeHint("Pick a joint with J or a body with N first; G then drags it with the arrow keys.");
    if (found.pin) drawing.moving = { point: found.pin.point, from: found.pin.world, world: found.pin.world };
    else if (!beginDrag(found.place)) return writeHint("This part cannot be dragged.");
    drawing.grabbed = true;
    return writeHint("The arrow keys move it by the grid, with Shift by five steps. Enter ends, Escape leaves a pin where it was.");
}

function moveGrabbed([x, y], far) {
    const { right, up } = frameNow(), step = gridStep() * (far ? 5 : 1), by = add(scaled(x * step, right), scaled(-y * step, up));
    if (drawing.moving) drawing.moving.world = snapped(add(drawing.moving.world, by));
    else if (drawing.dragged) pull(add(drawing.dragged.target, by));
}

/* A pin goes to its place, unless the keys were left; a body stays where it was dragged to. */
function endGrab(keeps) {
    const { moving, dragged } = drawing;
    Object.assign(drawing, { grabbed: false, moving: null });
    if (moving && keeps) setPin(moving);
    else if (dragged) endDrag(dragged);
    writeHint();
}

function typed(event) {
    const arrow = ARROWS[event.key], { camera } = shownScene, middle = [byId("view").clientWidth / 2, byId("view").clientHeight / 2];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const done = () => event.preventDefault();
    if (drawing.grabbed && arrow) moveGrabbed(arrow, event.shiftKey);
    else if (drawing.grabbed && ["Enter", "Escape", "g"].includes(event.key)) endGrab(event.key !== "Escape");
    else if (arrow && drawing.tool !== "select") moveCross(arrow, event.shiftKey);
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
    else if (event.key === "n" || event.key === "N") pickNextPart(event.key === "N");
    else if (event.key === "g") grab();
    else if ((event.key === "Delete" || event.key === "Backspace") && drawing.picked) removed(drawing.picked);
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
