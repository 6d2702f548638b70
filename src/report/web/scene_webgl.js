/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism by three.js. */
"use strict";

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

/* A hole is drawn over the face that it is in. */
function solidMesh(part, colour) {
    const geometry = new THREE.BufferGeometry(), material = solid(colour);
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(part.triangles.flatMap((list) => list.flatMap((k) => part.points[k])), 3));
    geometry.setAttribute("normal", new THREE.Float32BufferAttribute(part.corners.flat(), 3));
    Object.assign(material, { transparent: part.opacity < 1, opacity: part.opacity, depthWrite: part.opacity === 1, polygonOffset: part.hole, polygonOffsetFactor: 0, polygonOffsetUnits: -16 });
    return new THREE.Mesh(geometry, material);
}

function bodyGroup(m, b) {
    const group = new THREE.Group(), shape = m.shapes[b], material = solid(bodyColour(b)), pin = solid(pinColour());
    for (const [i, j] of shape.bars) group.add(barMesh(shape.points[i], shape.points[j], m.thick, material));
    for (const corners of shape.faces) group.add(faceMesh(shape.points, corners, bodyColour(b)));
    for (const part of shape.solids) group.add(solidMesh(part, solidColour(part, b)));
    for (const p of shape.solids.length > 0 ? [] : shape.points) group.add(ballMesh(p, 1.02 * m.thick, material));
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
    for (const part of m.shapes[0].solids) group.add(solidMesh(part, solidColour(part, 0)));
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
    const lines = m.lines.map((line) => {
        const material = solid(groundColour());
        return line.rod ? barMesh([0, 0, -0.5], [0, 0, 0.5], 0.7 * m.thick, material) : springMesh(2.4 * m.thick, 0.4 * m.thick, material);
    });
    for (const guide of m.guides) groups[guide.body].add(barMesh(...guideEnds(m, guide), 0.35 * m.thick, solid(groundColour())));
    for (const { body, ends } of m.barrels) groups[body].add(barMesh(...ends, BARREL * m.thick, solid(bodyColour(body))));
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
            built.lines.forEach((mesh, k) => placeLine(mesh, m.lines[k], poses));
            renderer.render(built.scene, camera);
        },
    };
}
