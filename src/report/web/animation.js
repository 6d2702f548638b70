/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving picture: by three.js, or on a plain canvas where there is no WebGL; playing, and turning with the mouse. */
"use strict";

const LIGHT_BODIES = ["#c0392b", "#2471a3", "#1e8449", "#b9770e", "#7d3c98", "#117a65", "#5d6d7e", "#a04000"];
const DARK_BODIES = ["#ec7063", "#5dade2", "#58d68d", "#f5b041", "#bb8fce", "#48c9b0", "#aeb6bf", "#e59866"];
const PLAY_SECONDS = 10;
const STOP_COLOUR = "#e11d1d";

const bodyColour = (b) => (isDark() ? DARK_BODIES : LIGHT_BODIES)[(b - 1) % LIGHT_BODIES.length];
const pinColour = () => (isDark() ? "#dfe6e9" : "#2c3437");
const groundColour = () => (isDark() ? "#7f8c92" : "#8a949a");

/* A slider is a box, a smaller one on a body with other shapes. */
const boxSize = (m, b) => (m.shapes[b].bars.length > 0 ? 3.3 : 5.5) * m.thick;

/* -- three.js ----------------------------------------------------------------------------------------------- */

function hasWebGL() {
    try {
        return Boolean(document.createElement("canvas").getContext("webgl"));
    } catch (error) {
        return false;
    }
}

const vector = (v) => new THREE.Vector3(...v);

/* The rotation that brings one axis onto a direction. */
function alongAxis(axis, direction) {
    return new THREE.Quaternion().setFromUnitVectors(vector(axis), vector(unit(direction)));
}

function solid(colour) {
    return new THREE.MeshPhongMaterial({ color: colour, shininess: 35, specular: 0x222222 });
}

function barMesh(a, b, radius, material) {
    const mesh = new THREE.Mesh(new THREE.CylinderBufferGeometry(radius, radius, norm(sub(b, a)), 14), material);
    mesh.position.copy(vector(scaled(0.5, add(a, b))));
    mesh.quaternion.copy(alongAxis([0, 1, 0], sub(b, a)));
    return mesh;
}

function ballMesh(at, radius, material) {
    const mesh = new THREE.Mesh(new THREE.SphereBufferGeometry(radius, 20, 14), material);
    mesh.position.copy(vector(at));
    return mesh;
}

function faceMesh(points, corners, colour) {
    const geometry = new THREE.BufferGeometry(), place = [];
    for (let k = 1; k + 1 < corners.length; k++) place.push(...points[corners[0]], ...points[corners[k]], ...points[corners[k + 1]]);
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(place, 3));
    geometry.computeVertexNormals();
    return new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({ color: colour, side: THREE.DoubleSide, transparent: true, opacity: 0.28, depthWrite: false }));
}

function boxMesh(at, size, material) {
    const mesh = new THREE.Mesh(new THREE.BoxBufferGeometry(1.5 * size, size, size), material);
    mesh.position.copy(vector(at));
    return mesh;
}

/* A place where a run stopped: a large ball that lets the joint be seen. */
function stopMesh(m, at) {
    const mesh = ballMesh(at, 4 * m.thick, new THREE.MeshPhongMaterial({ color: STOP_COLOUR, transparent: true, opacity: 0.55, depthWrite: false }));
    mesh.renderOrder = 1;
    return mesh;
}

/* A helix of unit length along z, to be stretched. */
function springMesh(radius, wire, material) {
    const turns = 9, points = [];
    for (let k = 0; k <= 24 * turns; k++) {
        const s = k / (24 * turns), wide = s < 0.1 || s > 0.9 ? 0 : radius, angle = 2 * Math.PI * turns * s;
        points.push(vector([wide * Math.cos(angle), wide * Math.sin(angle), s]));
    }
    return new THREE.Mesh(new THREE.TubeBufferGeometry(new THREE.CatmullRomCurve3(points), 300, wire, 6), material);
}

function bodyGroup(m, b) {
    const group = new THREE.Group(), shape = m.shapes[b], material = solid(bodyColour(b)), pin = solid(pinColour());
    for (const [i, j] of shape.bars) group.add(barMesh(shape.points[i], shape.points[j], m.thick, material));
    for (const corners of shape.faces) group.add(faceMesh(shape.points, corners, bodyColour(b)));
    for (const p of shape.points) group.add(ballMesh(p, 1.02 * m.thick, material));
    for (const p of shape.balls) group.add(ballMesh(p, 1.75 * m.thick, pin));
    for (const hinge of shape.hinges) group.add(barMesh(...hingeEnds(m, hinge), 1.75 * m.thick, pin));
    for (const p of shape.boxes) group.add(boxMesh(p, boxSize(m, b), material));
    for (const p of shape.weights) group.add(ballMesh(p, 2.6 * m.thick, material));
    for (const p of shape.stops) group.add(stopMesh(m, p));
    return group;
}

/* A wheel: a transparent thin disc, its rim and three spokes. */
function discGroup(m, disc) {
    const group = new THREE.Group(), material = solid(bodyColour(disc.body)), rim = discRim(disc);
    const plate = new THREE.Mesh(new THREE.CylinderBufferGeometry(disc.radius, disc.radius, m.thick, 48),
        new THREE.MeshPhongMaterial({ color: bodyColour(disc.body), transparent: true, opacity: 0.35, depthWrite: false }));
    plate.position.copy(vector(disc.at));
    plate.quaternion.copy(alongAxis([0, 1, 0], disc.axis));
    group.add(plate, new THREE.Mesh(new THREE.TubeBufferGeometry(new THREE.CatmullRomCurve3(rim.map(vector), true), 96, 0.7 * m.thick, 6), material));
    for (const end of discSpokes(rim)) group.add(barMesh(disc.at, end, 0.5 * m.thick, material));
    return group;
}

function groundGroup(m) {
    const group = new THREE.Group(), material = solid(groundColour()), down = scaled(-1, m.basis.up), high = 6 * m.thick;
    for (const p of m.pins) {
        const cone = new THREE.Mesh(new THREE.ConeBufferGeometry(0.6 * high, high, 24), material);
        cone.position.copy(vector(add(p, scaled(high / 2, down))));
        cone.quaternion.copy(alongAxis([0, 1, 0], m.basis.up));
        group.add(cone, ballMesh(p, 1.75 * m.thick, solid(pinColour())));
    }
    for (const rail of m.rails) rail.slice(1).forEach((p, k) => group.add(barMesh(rail[k], p, 0.8 * m.thick, material)));
    return group;
}

/* A hinge is a pin along its axis. */
const hingeEnds = (m, { at, axis }) => [-1, 1].map((s) => add(at, scaled(2.6 * s * m.thick, unit(axis))));

/* The ends of a guide, beyond its slider's range. */
const guideEnds = (m, guide) => [guide.range[0] - 5 * m.thick, guide.range[1] + 5 * m.thick].map((s) => add(guide.at, scaled(s, guide.axis)));

function buildScene(m) {
    const scene = new THREE.Scene(), key = new THREE.DirectionalLight(0xffffff, 0.75), fill = new THREE.DirectionalLight(0xffffff, 0.3);
    const groups = [groundGroup(m), ...m.shapes.slice(1).map((shape, k) => bodyGroup(m, k + 1))];
    const lines = m.picture.lines.map((line) => {
        const material = solid(groundColour());
        return line.rod ? barMesh([0, 0, -0.5], [0, 0, 0.5], 0.7 * m.thick, material) : springMesh(2.4 * m.thick, 0.4 * m.thick, material);
    });
    for (const guide of m.picture.guides) groups[guide.body].add(barMesh(...guideEnds(m, guide), 0.35 * m.thick, solid(groundColour())));
    for (const disc of m.discs) groups[disc.body].add(discGroup(m, disc));
    for (const path of m.paths) {
        const geometry = new THREE.BufferGeometry().setFromPoints(path.points.map(vector));
        scene.add(new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: bodyColour(path.b), transparent: true, opacity: 0.55 })));
    }
    scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 0.55), key, fill, ...groups, ...lines);
    return { scene, key, fill, groups, lines };
}

/* A rod is a unit cylinder about its middle along y, turned to z when made; a spring begins at its first end. */
function placeLine(mesh, line, poses) {
    const [a, b] = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
    const length = Math.max(norm(sub(b, a)), 1e-9);
    mesh.position.copy(vector(line.rod ? scaled(0.5, add(a, b)) : a));
    mesh.quaternion.copy(alongAxis(line.rod ? [0, 1, 0] : [0, 0, 1], sub(b, a)));
    mesh.scale.set(1, line.rod ? length : 1, line.rod ? 1 : length);
}

function dispose(scene) {
    scene.traverse((object) => {
        if (object.geometry) object.geometry.dispose();
        if (object.material) object.material.dispose();
    });
}

function glView(canvas, m) {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01 * m.size, 100 * m.size);
    let built = buildScene(m);
    return {
        kind: "webgl",
        rebuild() {
            dispose(built.scene);
            built = buildScene(m);
        },
        draw(poses, view) {
            const { width, height } = view, centre = m.centreAt(poses);
            renderer.setPixelRatio(window.devicePixelRatio || 1);
            renderer.setSize(width, height, false);
            [camera.left, camera.right, camera.top, camera.bottom] = [-width, width, height, -height].map((x) => x / (2 * view.scale));
            camera.position.copy(vector(add(centre, scaled(20 * m.size, view.out))));
            camera.up.copy(vector(view.up));
            camera.lookAt(vector(centre));
            camera.updateProjectionMatrix();
            built.key.position.copy(vector(add(view.out, add(view.up, scaled(-0.6, view.right)))));
            built.fill.position.copy(vector(sub(view.out, scaled(0.8, view.up))));
            poses.forEach((pose, b) => {
                built.groups[b].visible = !view.hidden.has(b);
                built.groups[b].position.copy(vector(pose.p));
                built.groups[b].quaternion.set(...pose.q);
            });
            built.lines.forEach((mesh, k) => placeLine(mesh, m.picture.lines[k], poses));
            renderer.render(built.scene, camera);
        },
    };
}

/* -- a plain canvas ----------------------------------------------------------------------------------------- */

function strokeLine(c, points, width, colour) {
    c.lineWidth = Math.max(width, 1);
    c.strokeStyle = colour;
    c.lineCap = c.lineJoin = "round";
    c.beginPath();
    points.forEach(([x, y], k) => (k === 0 ? c.moveTo(x, y) : c.lineTo(x, y)));
    c.stroke();
}

function fillShape(c, points, colour, opacity) {
    c.globalAlpha = opacity;
    c.fillStyle = colour;
    c.beginPath();
    points.forEach(([x, y], k) => (k === 0 ? c.moveTo(x, y) : c.lineTo(x, y)));
    c.fill();
    c.globalAlpha = 1;
}

function fillDisc(c, [x, y], radius, colour) {
    c.fillStyle = colour;
    c.beginPath();
    c.arc(x, y, Math.max(radius, 1), 0, 2 * Math.PI);
    c.fill();
}

function ringAround(c, [x, y], radius) {
    c.strokeStyle = STOP_COLOUR;
    c.lineWidth = 3;
    c.beginPath();
    c.arc(x, y, Math.max(radius, 6), 0, 2 * Math.PI);
    c.stroke();
}

function zigzag([ax, ay], [bx, by], wide) {
    const length = Math.hypot(bx - ax, by - ay) || 1, nx = (-(by - ay) / length) * wide, ny = ((bx - ax) / length) * wide, points = [[ax, ay]];
    for (let k = 0; k <= 16; k++) {
        const s = 0.12 + (0.76 * k) / 16, side = k === 0 || k === 16 ? 0 : k % 2 ? 1 : -1;
        points.push([ax + s * (bx - ax) + side * nx, ay + s * (by - ay) + side * ny]);
    }
    return [...points, [bx, by]];
}

/* The drawn parts of a body, each with its depth, so that distant parts are drawn first. */
function bodyJobs(m, b, pose, see, depth, scale) {
    const shape = m.shapes[b], colour = bodyColour(b), jobs = [], world = shape.points.map((p) => moved(pose, p));
    const middle = (list) => list.reduce((sum, p) => sum + depth(p), 0) / list.length;
    const push = (at, draw) => jobs.push({ depth: at, draw });
    for (const corners of shape.faces) {
        const points = corners.map((k) => world[k]);
        push(middle(points), (c) => fillShape(c, points.map(see), colour, 0.25));
    }
    for (const [i, j] of shape.bars) push(middle([world[i], world[j]]), (c) => strokeLine(c, [see(world[i]), see(world[j])], 2 * m.thick * scale, colour));
    for (const p of shape.balls) push(depth(moved(pose, p)) + 3 * m.thick, (c) => fillDisc(c, see(moved(pose, p)), 1.75 * m.thick * scale, pinColour()));
    for (const hinge of shape.hinges) {
        const ends = hingeEnds(m, hinge).map((p) => moved(pose, p));
        push(middle(ends) + 3 * m.thick, (c) => strokeLine(c, ends.map(see), 3.5 * m.thick * scale, pinColour()));
    }
    for (const p of shape.stops) push(Infinity, (c) => ringAround(c, see(moved(pose, p)), 4 * m.thick * scale));
    for (const p of shape.weights) push(depth(moved(pose, p)) + m.thick, (c) => fillDisc(c, see(moved(pose, p)), 2.6 * m.thick * scale, colour));
    for (const p of shape.boxes) {
        const corners = [[-1.5, -1], [1.5, -1], [1.5, 1], [-1.5, 1]].map(([x, y]) => moved(pose, add(p, scaled(boxSize(m, b) / 2, [x, y, 0]))));
        push(depth(moved(pose, p)) + m.thick, (c) => fillShape(c, corners.map(see), colour, 1));
    }
    return jobs;
}

/* Behind the bodies' bars, as far away as their middles. */
function discJobs(m, poses, see, depth, scale, hidden) {
    return m.discs.filter((disc) => !hidden.has(disc.body)).map((disc) => {
        const rim = discRim(disc).map((p) => moved(poses[disc.body], p)), middle = moved(poses[disc.body], disc.at), colour = bodyColour(disc.body);
        return { depth: depth(middle), draw: (c) => {
            fillShape(c, rim.map(see), colour, 0.2);
            strokeLine(c, [...rim, rim[0]].map(see), 1.4 * m.thick * scale, colour);
            for (const end of discSpokes(rim)) strokeLine(c, [see(middle), see(end)], m.thick * scale, colour);
        } };
    });
}

function drawPins(c, m, see, scale) {
    const high = 6 * m.thick * scale;
    for (const p of m.pins) {
        const [x, y] = see(p);
        fillShape(c, [[x, y], [x - 0.6 * high, y + high], [x + 0.6 * high, y + high]], groundColour(), 1);
        fillDisc(c, [x, y], 1.75 * m.thick * scale, pinColour());
    }
}

function canvasView(canvas, m) {
    const c = canvas.getContext("2d");
    return {
        kind: "canvas",
        rebuild() {},
        draw(poses, view) {
            const sharp = window.devicePixelRatio || 1, scale = view.scale;
            const depth = (p) => dot(p, view.out), from = m.centreAt(poses);
            const see = (p) => [view.width / 2 + scale * dot(sub(p, from), view.right), view.height / 2 - scale * dot(sub(p, from), view.up)];
            canvas.width = Math.round(view.width * sharp);
            canvas.height = Math.round(view.height * sharp);
            c.scale(sharp, sharp);
            for (const guide of m.picture.guides) strokeLine(c, guideEnds(m, guide).map((p) => see(moved(poses[guide.body], p))), 0.7 * m.thick * scale, groundColour());
            drawPins(c, m, see, scale);
            for (const rail of m.rails) strokeLine(c, rail.map(see), 1.6 * m.thick * scale, groundColour());
            c.globalAlpha = 0.55;
            for (const path of m.paths) strokeLine(c, path.points.map(see), 1, bodyColour(path.b));
            c.globalAlpha = 1;
            const jobs = poses.flatMap((pose, b) => (b === 0 || view.hidden.has(b) ? [] : bodyJobs(m, b, pose, see, depth, scale)));
            jobs.push(...discJobs(m, poses, see, depth, scale, view.hidden));
            for (const line of m.picture.lines) {
                const ends = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
                const path = line.rod ? ends.map(see) : zigzag(...ends.map(see), 2.4 * m.thick * scale);
                jobs.push({ depth: (depth(ends[0]) + depth(ends[1])) / 2, draw: () => strokeLine(c, path, (line.rod ? 1.4 : 0.8) * m.thick * scale, groundColour()) });
            }
            jobs.sort((a, b) => a.depth - b.depth);
            for (const job of jobs) job.draw(c);
        },
    };
}

/* -- the stage ---------------------------------------------------------------------------------------------- */

function stageNote(picture) {
    const notes = [], drawn = picture.bodies.length - 1;
    if (picture.frames.t_end === 0) notes.push("The mechanism at its start, as far as it can be assembled.");
    else if (picture.frames.t_end < 0.999 * data.t_end) notes.push(`The animation shows the first ${three(picture.frames.t_end)} s of ${three(data.t_end)} s.`);
    if (drawn < picture.of_bodies) notes.push(`${drawn} of ${picture.of_bodies} bodies are drawn.`);
    return notes.join(" ");
}

/* A legend of the bodies' colours, whose names switch them off and on, unless there are too many. */
function tellNames(bodies, hidden, change) {
    const most = 40, names = bodies.slice(1).map((body, k) => {
        const name = element("button", body.name), b = k + 1;
        name.type = "button";
        name.style.color = bodyColour(b);
        name.setAttribute("aria-pressed", String(!hidden.has(b)));
        name.title = `${hidden.has(b) ? "Show" : "Hide"} ${body.name}`;
        name.addEventListener("click", () => {
            if (!hidden.delete(b)) hidden.add(b);
            change();
        });
        return name;
    });
    byId("names").replaceChildren(...(names.length > most ? [] : names));
}

/* -- over the picture --------------------------------------------------------------------------------------- */

/* The place of a point in the view, in pixels. */
function projection(m, poses, view) {
    const from = m.centreAt(poses);
    return (p) => [view.width / 2 + view.scale * dot(sub(p, from), view.right), view.height / 2 - view.scale * dot(sub(p, from), view.up)];
}

/* An element of SVG as text, of words of this page alone. */
function svgPart(tag, attributes, text = "") {
    const words = Object.entries(attributes).map(([name, value]) => `${name}="${value}"`);
    return `<${tag} ${words.join(" ")}>${text}</${tag}>`;
}

/* An arrow from a place along a direction of the model as it is seen, with a letter at its tip; a dot where it points at
 * the viewer. */
function arrow([x, y], direction, view, length, colour, name) {
    const dx = length * dot(direction, view.right), dy = -length * dot(direction, view.up), long = Math.hypot(dx, dy);
    if (long < 3) return [svgPart("circle", { cx: x, cy: y, r: 2.5, fill: colour })];
    const [ux, uy] = [dx / long, dy / long], tip = [x + dx, y + dy];
    const barbs = [[-ux - 0.6 * uy, -uy + 0.6 * ux], [-ux + 0.6 * uy, -uy - 0.6 * ux]].map(([a, b]) => `${tip[0] + 5 * a},${tip[1] + 5 * b}`);
    return [
        svgPart("path", { d: `M${x},${y}L${tip}M${barbs[0]}L${tip}L${barbs[1]}`, stroke: colour, "stroke-width": 1.6, fill: "none" }),
        svgPart("text", { x: tip[0] + 8 * ux, y: tip[1] + 8 * uy + 4, fill: colour, "font-size": 11, "text-anchor": "middle" }, name),
    ];
}

/* A length of 1, 2 or 5 times a power of ten that fits into so many pixels. */
function evenLength(most) {
    const power10 = 10 ** Math.floor(Math.log10(most));
    return power10 * [5, 2, 1].find((part) => part * power10 <= most);
}

function lengthWords(metres) {
    return metres >= 1000 ? `${three(metres / 1000)} km` : metres >= 1 ? `${three(metres)} m` : metres >= 1e-3 ? `${three(1000 * metres)} mm` : `${three(1e6 * metres)} \u00b5m`;
}

/* Axes of the ground, direction of gravity, and a scale. */
function drawGauge(gauge, m, view) {
    const ink = softColour(), low = view.height - 26, length = evenLength(90 / view.scale), wide = length * view.scale, right = view.width - 10;
    const parts = [["x", [1, 0, 0]], ["y", [0, 1, 0]], ["z", [0, 0, 1]]].flatMap(([name, axis]) => arrow([34, low], axis, view, 20, ink, name));
    if (norm(m.picture.gravity) > 0) parts.push(...arrow([92, low - 20], unit(m.picture.gravity), view, 22, ink, "g"));
    parts.push(svgPart("path", { d: `M${right - wide},${low + 8}v6h${wide}v-6`, stroke: ink, "stroke-width": 1.4, fill: "none" }));
    parts.push(svgPart("text", { x: right - wide / 2, y: low + 6, fill: ink, "font-size": 11, "text-anchor": "middle" }, lengthWords(length)));
    gauge.innerHTML = parts.join("");
    gauge.dataset.scale = lengthWords(length);
}

function distanceTo([x, y], [ax, ay], [bx, by]) {
    const l = (bx - ax) ** 2 + (by - ay) ** 2, s = l > 0 ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / l, 0), 1) : 0;
    return Math.hypot(x - ax - s * (bx - ax), y - ay - s * (by - ay));
}

/* The name of what is nearest to a place of the view: a joint or point, else a body; "" where nothing is near. */
function nameAt(place, m, poses, view) {
    const see = projection(m, poses, view), near = 10;
    let best = near, name = "";
    const offer = (distance, words) => {
        if (distance < best) [best, name] = [distance, words];
    };
    m.picture.bodies.forEach((body, b) => {
        if (view.hidden.has(b)) return;
        for (const p of body.points) if (p[4]) offer(Math.hypot(...see(moved(poses[b], p.slice(0, 3))).map((x, k) => x - place[k])) - 2, `${body.name}: ${p[4]}`);
        const shape = m.shapes[b], world = shape.points.map((p) => see(moved(poses[b], p)));
        if (b > 0) for (const [i, j] of shape.bars) offer(distanceTo(place, world[i], world[j]), body.name);
    });
    for (const disc of m.discs) if (!view.hidden.has(disc.body)) offer(Math.hypot(...see(moved(poses[disc.body], disc.at)).map((x, k) => x - place[k])), m.picture.bodies[disc.body].name);
    for (const line of m.picture.lines) offer(distanceTo(place, ...[0, 1].map((k) => see(moved(poses[line.body[k]], line.at[k])))), line.name);
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
 * give the texts under the picture. */
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
    const hidden = new Set(), over = element("div.over"), label = element("span.label-at");
    let t = 0, playing = false, last = 0, shown = null;
    over.innerHTML = svgPart("svg", { class: "gauge", "aria-hidden": "true" });
    const gauge = over.firstChild;
    canvas.parentElement.append(over, label);

    function draw() {
        const width = Math.max(canvas.clientWidth, 50), height = Math.max(canvas.clientHeight, 50);
        const room = 1.12, border = 9 * m.thick;
        const scale = orbit.zoom * Math.min(width / (2 * (room * m.extent.width + border)), height / (2 * (room * m.extent.height + border)));
        shown = [m, m.motion(ask.span()[0] + t), { width, height, scale, hidden, ...turnedBasis(m.basis, orbit.yaw, orbit.pitch) }];
        view.draw(...shown.slice(1));
        drawGauge(gauge, m, shown[2]);
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
        tellNames(picture.bodies, hidden, renew);
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
    byId("stage-note").textContent = ask.note(picture);
    tellNames(picture.bodies, hidden, renew);
    byId("play").parentElement.hidden = !(length() > 0);
    canvas.dataset.frames = picture.frames.count;
    canvas.dataset.bodies = picture.bodies.length;
    canvas.dataset.view = view.kind;
    canvas.dataset.follows = String(m.follows);
    canvas.dataset.planar = String(m.basis.planar);
    draw();
    play(!calm);
    return {
        recolour() {
            view.rebuild();
            renew();
        },
        /* Shows a time, and does not go on. */
        seek(time) {
            play(false);
            t = Math.min(Math.max(time - ask.span()[0], 0), length());
            byId("time").value = String(Math.round((1000 * t) / (length() || 1)));
            draw();
        },
        /* Another span: from its beginning. */
        restart() {
            t = 0;
            byId("stage-note").textContent = ask.note(picture);
            draw();
            play(!calm);
        },
    };
}
