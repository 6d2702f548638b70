/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism of the workbench: what is drawn, from where, at which time, and what is at a place of the picture. The drawing
 * itself is in the scripts of report pages (src/report/web). */
"use strict";

const NEAR_PIXELS = { mouse: 11, pen: 14, touch: 22 };
const FRONT = { right: [1, 0, 0], up: [0, 1, 0], out: [0, 0, 1], planar: true };
const EMPTY_WIDTH = 1.6; /* m that an empty page shows */

/* Data of a report page that no page of flexible bodies needs: nothing deforms. */
function withoutDeformation(picture) {
    const none = { numbers: "", middle: 0, unit: 0 };
    return { parents: picture.bodies.map(() => 0), factor: 1, shift: none, turn: none, riders: [], held: [], stiff: [], plain: [], stress: null };
}

/* The data of a report page, from its text. */
function pageData(html) {
    const from = html.indexOf('<script type="application/json" id="data">'), begin = html.indexOf("\n", from), end = html.indexOf("</script>", begin);
    if (from < 0) throw new Error("the report page has no data");
    return JSON.parse(html.slice(begin, end));
}

const shownScene = {
    m: null, view: null, renderer: null, picture: null,
    basis: FRONT, camera: { centre: [0.35, 0.2, 0], scale: 0, yaw: 0, pitch: 0, home: { yaw: 0, pitch: 0 } }, fitted: false,
    poses: [], posed: null, t: 0, playing: false, last: 0, speed: 1, hidden: new Set(),
    over: [], /* functions (see, frame) that give elements over the picture */
    drawn: [], /* functions that are called after each drawing */
};

/* -- the picture -------------------------------------------------------------------------------------------- */

function endScene() {
    shownScene.view?.end?.();
    Object.assign(shownScene, { m: null, view: null, picture: null, posed: null, poses: [] });
}

/* A state whose joints and points are in a plane is seen from its front, however thick the bodies are. */
function withFlatStart(m) {
    const poses = m.motion(m.picture.frames.t_start), places = m.picture.bodies.flatMap((body, b) => body.points.map((p) => moved(poses[b], p.slice(0, 3))));
    if (m.basis.planar || m.picture.frames.count > 1 || places.length < 2) return m;
    const tracks = places.map((p) => [p]), basis = basisOf(m.picture, tracks);
    return basis.planar ? { ...m, basis, home: { yaw: 0, pitch: 0 }, extent: extentOf(basis, tracks, 0) } : m;
}

/* Shows the picture of a report's data from its first time on; null: an empty page. `keep`: from the same viewpoint. */
function showScene(page, { keep = true } = {}) {
    const canvas = byId("view"), scene = shownScene;
    let turned3d = false;
    endScene();
    play(false);
    Object.assign(scene, { span: null, period: 0 });
    Object.assign(data, { separate: false, stopped_at: [], reactions: null, command: "" }, page || {}, { picture: page ? page.picture : null });
    forces = data.picture && data.picture.arrows ? readForces(data.picture.arrows) : null;
    if (page && page.picture) {
        const { picture } = page;
        picture.flexible ||= withoutDeformation(picture);
        scene.picture = picture;
        scene.m = withFlatStart(makeMechanism(picture));
        if (scene.gl ?? (scene.gl = hasWebGL())) {
            scene.view = glView(canvas, scene.m, scene.renderer || undefined);
            scene.renderer = scene.view.renderer;
        } else {
            scene.view = canvasView(canvas, scene.m);
        }
        const own = scene.m.centreAt;
        scene.m.centreAt = (poses) => (scene.m.follows ? own(poses) : scene.camera.centre);
        turned3d = scene.basis.planar !== scene.m.basis.planar;
        scene.basis = scene.m.basis;
        canvas.dataset.bodies = picture.bodies.length;
        canvas.dataset.frames = picture.frames.count;
        canvas.dataset.kind = scene.view.kind;
    } else {
        canvas.dataset.bodies = canvas.dataset.frames = "0";
        scene.renderer?.clear();
    }
    scene.t = page?.picture ? page.picture.frames.t_start : 0;
    if (!keep || !scene.fitted || turned3d || isOutOfView()) fitScene();
    showTimeBar();
    drawScene();
}

/* True where a part of the motion is outside of the first view of a model; while parts are drawn the view stays. */
function isOutOfView() {
    const { m, camera } = shownScene, { width, height, scale, right, up } = frameNow();
    if (!m || m.follows || drawing.tool !== "select" || camera.yaw !== m.home.yaw || camera.pitch !== m.home.pitch) return false;
    const away = sub(m.extent.centre, camera.centre), beyond = (axis, half, pixels) => Math.abs(dot(away, axis)) + half > (0.5 * pixels) / scale;
    return beyond(right, m.extent.width, width) || beyond(up, m.extent.height, height);
}

/* All of the motion is in view. */
function fitScene() {
    const { m, camera } = shownScene, box = byId("view");
    const width = Math.max(box.clientWidth, 50), height = Math.max(box.clientHeight, 50);
    camera.home = m ? m.home : { yaw: 0, pitch: 0 };
    Object.assign(camera, camera.home);
    if (!m) {
        Object.assign(camera, { centre: [0.45, 0.25, 0], scale: Math.min(width / EMPTY_WIDTH, (1.4 * height) / EMPTY_WIDTH) });
        shownScene.basis = FRONT;
        shownScene.fitted = false;
        return;
    }
    const border = 9 * m.thick, room = 1.15, sizes = [[width, m.extent.width], [height, m.extent.height]];
    Object.assign(camera, { centre: m.extent.centre, scale: Math.min(...sizes.map(([pixels, half]) => pixels / (2 * (room * half + border) || 1))) });
    shownScene.fitted = true;
}

/* -- from where --------------------------------------------------------------------------------------------- */

/* Size, scale and axes of the view. */
function frameNow() {
    const { camera, basis, hidden } = shownScene, box = byId("view");
    return { width: Math.max(box.clientWidth, 50), height: Math.max(box.clientHeight, 50), scale: camera.scale || 400, hidden, ...turnedBasis(basis, camera.yaw, camera.pitch) };
}

const centreNow = () => (shownScene.m ? shownScene.m.centreAt(shownScene.poses) : shownScene.camera.centre);

/* Pixels of a point, and the point below a pixel at the depth of another one. */
function seeNow(frame = frameNow(), centre = centreNow()) {
    return (p) => [frame.width / 2 + frame.scale * dot(sub(p, centre), frame.right), frame.height / 2 - frame.scale * dot(sub(p, centre), frame.up)];
}

function worldAt([x, y], depthOf = null, frame = frameNow()) {
    const centre = centreNow(), flat = add(centre, add(scaled((x - frame.width / 2) / frame.scale, frame.right), scaled((frame.height / 2 - y) / frame.scale, frame.up)));
    return depthOf ? add(flat, scaled(dot(sub(depthOf, flat), frame.out), frame.out)) : flat;
}

/* The axis of the ground that looks at the viewer, "z"; null: the view is oblique. */
function drawingNormal() {
    const { out } = frameNow(), k = [0, 1, 2].find((i) => Math.abs(Math.abs(out[i]) - 1) < 1e-6);
    return k === undefined ? null : "xyz"[k];
}

/* Distance of the points that the mouse sets in empty space, m. */
const gridStep = () => evenLength(14 / frameNow().scale);

function snapped(p) {
    const step = gridStep();
    return p.map((x) => Number((Math.round(x / step) * step).toFixed(6)));
}

/* -- drawing ------------------------------------------------------------------------------------------------ */

/* The times that are played: all of them, or those of one mode. */
const timeSpan = () => shownScene.span || (shownScene.picture ? [shownScene.picture.frames.t_start, shownScene.picture.frames.t_end] : [0, 0]);

function drawScene() {
    const scene = shownScene, gauge = byId("gauge"), frame = frameNow();
    gauge.setAttribute("viewBox", `0 0 ${frame.width} ${frame.height}`);
    if (scene.m) {
        scene.poses = scene.posed || scene.m.motion(scene.t);
        scene.view.draw(scene.poses, frame);
        drawGauge(gauge, scene.m, frame);
        if (scene.picture.flexible.factor === 1) gauge.querySelector("#deformed")?.remove();
        else gauge.querySelector("#deformed")?.setAttribute("y", 40); /* below the hint */
        if (!scene.posed) gauge.append(...forceArrows(scene.m, scene.poses, frame, scene.t));
    } else {
        gauge.replaceChildren();
    }
    const see = seeNow(frame);
    for (const over of scene.over) gauge.append(...over(see, frame));
    for (const follow of scene.drawn) follow(scene.t);
}

/* -- time --------------------------------------------------------------------------------------------------- */

function showTimeBar() {
    const [from, to] = timeSpan();
    byId("time-bar").hidden = !(to > from);
    byId("time").value = "0";
    writeClock();
}

/* States of a study and phases of a mode have no time. */
function writeClock() {
    byId("clock").textContent = data.separate || data.command === "modes" ? "" : clockOf(shownScene.t, timeSpan()[1]);
}

function showTime(t) {
    const [from, to] = timeSpan();
    shownScene.posed = null;
    shownScene.t = Math.min(Math.max(t, from), to);
    byId("time").value = String(Math.round((1000 * (shownScene.t - from)) / (to - from || 1)));
    writeClock();
    drawScene();
}

function stepTime(now) {
    const scene = shownScene, [from, to] = timeSpan();
    if (!scene.playing || !scene.picture) return;
    const seconds = scene.period || Math.min(Math.max(to - from, 2), 20), t = scene.t + (((now - scene.last) / 1000) * scene.speed * (to - from)) / seconds;
    scene.last = now;
    showTime(t > to ? from + ((t - from) % (to - from)) : t);
    requestAnimationFrame(stepTime);
}

function play(on) {
    const scene = shownScene, [from, to] = timeSpan(), before = scene.playing;
    scene.playing = Boolean(on && to > from);
    byId("play").textContent = scene.playing ? "\u275a\u275a" : "\u25b6";
    byId("play").setAttribute("aria-pressed", String(scene.playing));
    scene.last = performance.now();
    if (scene.playing && !before) requestAnimationFrame(stepTime);
}

/* Poses in place of those of a time; by the name of each body, as a drag gives them. */
function showPoses(poses) {
    const { m } = shownScene;
    if (!m) return;
    play(false);
    shownScene.posed = m.picture.bodies.map((body, b) => (b === 0 || !poses[body.name] ? STILL : { p: poses[body.name].position, q: quaternionOf(poses[body.name].rotation) }));
    drawScene();
}

/* The quaternion x, y, z, w of a matrix by rows, from its largest component. */
function quaternionOf(r) {
    const trace = r[0][0] + r[1][1] + r[2][2], w = Math.sqrt(Math.max(1 + trace, 0)) / 2, k = [0, 1, 2].reduce((best, i) => (r[i][i] > r[best][best] ? i : best), 0);
    if (trace > 0) return [(r[2][1] - r[1][2]) / (4 * w), (r[0][2] - r[2][0]) / (4 * w), (r[1][0] - r[0][1]) / (4 * w), w];
    const [i, j] = [(k + 1) % 3, (k + 2) % 3], s = Math.sqrt(1 + r[k][k] - r[i][i] - r[j][j]) / 2, q = [0, 0, 0, (r[j][i] - r[i][j]) / (4 * s)];
    Object.assign(q, { [k]: s, [i]: (r[i][k] + r[k][i]) / (4 * s), [j]: (r[j][k] + r[k][j]) / (4 * s) });
    return q;
}

/* -- what is where ------------------------------------------------------------------------------------------ */

const poseOf = (name) => shownScene.poses[shownScene.picture ? shownScene.picture.bodies.findIndex((body) => body.name === name) : -1] || STILL;
const axesOf = (name) => GROUND_AXES.map((axis) => turned(poseOf(name).q, axis));
const localOf = (name, world) => inAxes(axesOf(name), sub(world, poseOf(name).p));

/* The angle of a body about the axis that looks at the viewer along a positive axis. */
function angleOf(name, normal = drawingNormal() || "z") {
    const { q } = poseOf(name), k = "xyz".indexOf(normal);
    return 2 * Math.atan2(q[k], q[3]);
}

/* All named points of the model, and origins that hold a joint, as places. */
function modelPlaces(model) {
    if (!model) return [];
    const named = (body, points) => Object.entries(points || {}).map(([point, local]) => ({ body, point, local: Array.isArray(local) ? local : local.at || [0, 0, 0] }));
    const places = [...named("ground", model.ground?.points), ...model.bodies.flatMap((body) => named(body.name, body.points))];
    for (const body of model.bodies) if (!body.to && !places.some((p) => p.body === body.name && norm(p.local) < 1e-12)) places.push({ body: body.name, point: "", local: [0, 0, 0] });
    if (model.bodies.some((body) => body.parent === "ground" && !body.at)) places.push({ body: "ground", point: "", local: [0, 0, 0] });
    return places.map((place) => ({ ...place, world: moved(poseOf(place.body), place.local), axes: axesOf(place.body) }));
}

/* Lines between the points of each body, which one sees as its bars. */
function modelBars(model) {
    const places = modelPlaces(model);
    return (model?.bodies || []).flatMap((body) => {
        const own = places.filter((place) => place.body === body.name), shape = hullOf(own.map((place) => place.local));
        return shape.bars.map(([i, j]) => [own[i], own[j]]);
    });
}

/* The nearest of several things to a pixel; null: none is within reach. */
function nearest(list, reach, distance) {
    const found = list.map((thing) => [distance(thing), thing]).filter(([away]) => away <= reach).sort((a, b) => a[0] - b[0])[0];
    return found ? found[1] : null;
}

const awayFrom = ([x, y], see) => ({ world }) => {
    const [a, b] = see(world);
    return Math.hypot(a - x, b - y);
};

/* The place at a pixel: a point of the model, a place on a bar, on a body, or in empty space (by the grid). */
function placeAtPixel(pixel, model, pointer = "mouse") {
    const see = seeNow(), reach = NEAR_PIXELS[pointer] || 11, places = modelPlaces(model), moving = places.filter(({ body }) => body !== "ground");
    const point = nearest(moving, reach, awayFrom(pixel, see)) || nearest(places, reach, awayFrom(pixel, see));
    if (point) return point;
    const bar = nearest(modelBars(model), reach, ([a, b]) => distanceTo(pixel, see(a.world), see(b.world)));
    if (bar) {
        const [a, b] = bar.map(({ world }) => see(world)), long = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 || 1;
        const part = Math.min(Math.max(((pixel[0] - a[0]) * (b[0] - a[0]) + (pixel[1] - a[1]) * (b[1] - a[1])) / long, 0), 1), local = add(scaled(1 - part, bar[0].local), scaled(part, bar[1].local)).map((x) => Number(x.toFixed(3)));
        return { body: bar[0].body, point: null, local, world: moved(poseOf(bar[0].body), local), axes: axesOf(bar[0].body) };
    }
    const name = shownScene.m ? nameAt(pixel, shownScene.m, shownScene.poses, frameNow()).split(":")[0] : "", body = model?.bodies.find((one) => one.name === name);
    if (body) {
        const world = worldAt(pixel, moved(poseOf(name), body.com || [0, 0, 0]));
        return { body: name, point: null, local: localOf(name, world).map((x) => Number(x.toFixed(3))), world, axes: axesOf(name) };
    }
    return { body: null, point: null, local: null, world: snapped(worldAt(pixel)), axes: GROUND_AXES };
}

/* Other points of the model at the same place. */
const placesAt = (place, model) => modelPlaces(model).filter((other) => other.body !== place.body && norm(sub(other.world, place.world)) < 1e-6 + 0.1 * gridStep());

/* The joints of a model { name, kind, coordinates, on, at, bodies }. */
function modelJoints(model) {
    if (!model) return [];
    const tree = model.bodies.map((body) => ({ name: body.joint, kind: body.motions.map(({ kind }) => kind).join(""), coordinates: body.motions.map(({ coordinate }) => coordinate), on: body.name, at: body.to ? body.points[body.to] : [0, 0, 0], bodies: [body.parent, body.name] }));
    const loops = model.closures.filter(({ points }) => points).map(({ name, kind, points }) => {
        const [on, point] = points[1].split("."), body = on === "ground" ? model.ground : model.bodies.find((one) => one.name === on);
        return { name, kind, coordinates: [], on, at: body?.points?.[point] || [0, 0, 0], bodies: points.map((end) => end.split(".")[0]) };
    });
    return [...tree, ...loops].filter(({ at }) => Array.isArray(at)).map((joint) => ({ ...joint, world: moved(poseOf(joint.on), joint.at) }));
}

/* The springs and other forces between two points { name, kind, ends: two places }. */
function modelForces(model) {
    const places = modelPlaces(model), placeOf = (end) => places.find(({ body, point }) => (point ? `${body}.${point}` : body) === end);
    const between = (model?.forces || []).map(({ name, kind, points }) => ({ name, kind, ends: (points || []).map(placeOf) }));
    return between.filter(({ ends }) => ends.length === 2 && ends.every(Boolean));
}

/* The part at a pixel { kind, name }: a joint, a spring, a body. null: there is none. */
function partAtPixel(pixel, model, pointer = "mouse") {
    const see = seeNow(), joint = jointAtPixel(pixel, model, pointer);
    if (joint) return { kind: "joint", name: joint.name };
    const force = nearest(modelForces(model), NEAR_PIXELS[pointer] || 11, ({ ends: [a, b] }) => distanceTo(pixel, see(a.world), see(b.world)));
    if (force) return { kind: "force", name: force.name };
    const { body } = placeAtPixel(pixel, model, pointer);
    return body && body !== "ground" ? { kind: "body", name: body } : null;
}

const jointAtPixel = (pixel, model, pointer = "mouse") => nearest(modelJoints(model), NEAR_PIXELS[pointer] + 3, awayFrom(pixel, seeNow()));
