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

/* Light lines across the picture, for bodies beyond the number of colours. three.js distinguishes shaders by the texts of these
 * functions. */
function lighten(shader, where) {
    shader.fragmentShader = shader.fragmentShader.replace("#include <color_fragment>", `#include <color_fragment>\nif (${where}) diffuseColor.rgb = mix(diffuseColor.rgb, vec3(1.0), 0.75);`);
}

const SHADERS = {
    hatched: (shader) => lighten(shader, "mod(gl_FragCoord.x + gl_FragCoord.y, 8.0) < 3.0"),
    crossed: (shader) => lighten(shader, "min(mod(gl_FragCoord.x + gl_FragCoord.y, 8.0), mod(gl_FragCoord.x - gl_FragCoord.y, 8.0)) < 2.5"),
};

function shining(colour, hatch) {
    const material = new THREE.MeshPhongMaterial({ color: colour, shininess: 35, specular: 0x222222 });
    if (hatch) material.onBeforeCompile = SHADERS[hatch];
    return material;
}

const transparent = (colour, opacity, more) => new THREE.MeshPhongMaterial({ color: colour, transparent: true, opacity, depthWrite: false, ...more });

function meshAt(geometry, material, at, axis, direction) {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.position.copy(vector(at));
    if (axis) mesh.quaternion.copy(alongAxis(axis, direction));
    return mesh;
}

function barMesh([a, b], radius, material) {
    return meshAt(new THREE.CylinderBufferGeometry(radius, radius, norm(sub(b, a)), 14), material, scaled(0.5, add(a, b)), [0, 1, 0], sub(b, a));
}

const ballMesh = (at, radius, material) => meshAt(new THREE.SphereBufferGeometry(radius, 20, 14), material, at);
const tubeMesh = (points, closed, pieces, radius, material) => new THREE.Mesh(new THREE.TubeBufferGeometry(new THREE.CatmullRomCurve3(points.map(vector), closed), pieces, radius, 6), material);

/* Prisms along the pieces of a line, as one mesh. */
function lineMesh(points, radius, material) {
    const places = [], normals = [], sides = 6;
    points.slice(1).forEach((b, k) => {
        const along = sub(b, points[k]);
        if (norm(along) === 0) return;
        const [x, y] = axesAlong(unit(along)), out = Array.from({ length: sides + 1 }, (_, i) => add(scaled(Math.cos((2 * Math.PI * i) / sides), x), scaled(Math.sin((2 * Math.PI * i) / sides), y)));
        for (let i = 0; i < sides; i++)
            for (const [end, j] of [[points[k], i], [points[k], i + 1], [b, i], [b, i], [points[k], i + 1], [b, i + 1]]) {
                places.push(add(end, scaled(radius, out[j])));
                normals.push(out[j]);
            }
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", placesOf(places));
    geometry.setAttribute("normal", placesOf(normals));
    material.side = THREE.DoubleSide;
    return new THREE.Mesh(geometry, material);
}

/* A filled profile: both faces are transparent, the wall between them is not. */
function profileMeshes({ points, axis, depth, colour, hatch }) {
    const up = unit(axis), [x, y] = axesAlong(up), flat = points.map((p) => new THREE.Vector2(dot(p, x), dot(p, y)));
    const ends = [-0.5, 0.5].map((s) => points.map((p) => add(p, scaled(s * depth, up)))), faces = new THREE.BufferGeometry(), wall = new THREE.BufferGeometry();
    const triangles = THREE.ShapeUtils.triangulateShape(flat, []);
    faces.setAttribute("position", placesOf(ends.flatMap((list) => triangles.flatMap((corners) => corners.map((k) => list[k])))));
    wall.setAttribute("position", placesOf(points.slice(1).flatMap((_, k) => [ends[0][k], ends[0][k + 1], ends[1][k], ends[1][k], ends[0][k + 1], ends[1][k + 1]])));
    for (const geometry of [faces, wall]) geometry.computeVertexNormals();
    const solid = shining(colour, hatch);
    solid.side = THREE.DoubleSide;
    return [new THREE.Mesh(wall, solid), new THREE.Mesh(faces, transparent(colour, 0.2, { side: THREE.DoubleSide }))];
}

/* A helix of unit length along z, to be stretched. */
function springMesh(radius, wire, material) {
    const turns = 9, points = [];
    for (let k = 0; k <= 24 * turns; k++) {
        const s = k / (24 * turns), wide = s < 0.1 || s > 0.9 ? 0 : radius, angle = 2 * Math.PI * turns * s;
        points.push([wide * Math.cos(angle), wide * Math.sin(angle), s]);
    }
    return tubeMesh(points, false, 300, wire, material);
}

const placesOf = (points) => new THREE.Float32BufferAttribute(points.flat(), 3);

/* A hole is drawn over the face that it is in. */
function solidMesh({ solid, colour, hatch }) {
    const geometry = new THREE.BufferGeometry(), material = shining(colour, hatch);
    geometry.setAttribute("position", placesOf(solid.triangles.flatMap((list) => list.map((k) => solid.points[k]))));
    geometry.setAttribute("normal", placesOf(solid.corners));
    Object.assign(material, { transparent: solid.opacity < 1, opacity: solid.opacity, depthWrite: solid.opacity === 1, polygonOffset: solid.hole, polygonOffsetFactor: 0, polygonOffsetUnits: -16 });
    return new THREE.Mesh(geometry, material);
}

/* A fan about the first point; of a strip the quadrangles between both edges. */
function faceMesh({ points, colour, strip }) {
    const geometry = new THREE.BufferGeometry(), pairs = points.slice(0, points.length / 2 - 1).map((p, k) => [p, points[k + 1], points.at(-1 - k), points.at(-2 - k)]);
    geometry.setAttribute("position", placesOf(strip ? pairs.flatMap(([a, b, c, d]) => [a, b, c, c, b, d]) : points.slice(2).flatMap((p, k) => [points[0], points[k + 1], p])));
    geometry.computeVertexNormals();
    return new THREE.Mesh(geometry, transparent(colour, 0.28, { side: THREE.DoubleSide }));
}

/* A large ball that lets the joint be seen. */
function stopMesh({ points, radius, colour }) {
    const mesh = ballMesh(points[0], radius, transparent(colour, 0.55));
    mesh.renderOrder = 1;
    return mesh;
}

/* A tyre is a torus around a rim with spokes. */
function tyreMeshes(m, disc, rim, colour, hatch) {
    const thick = tyreThickness(disc), inner = rim.map((p) => add(disc.at, scaled(1 - (2 * thick) / disc.radius, sub(p, disc.at))));
    return [
        meshAt(new THREE.TorusBufferGeometry(disc.radius - thick, thick, 16, 64), shining(tyreColour()), disc.at, [0, 0, 1], disc.axis),
        tubeMesh(inner, true, 2 * inner.length, 0.7 * m.thick, shining(colour, hatch)),
        meshAt(new THREE.CylinderBufferGeometry(disc.radius - 2 * thick, disc.radius - 2 * thick, m.thick, 48), transparent(colour, 0.35), disc.at, [0, 1, 0], disc.axis),
        ...discSpokes(inner).map((end) => barMesh([disc.at, end], 0.5 * m.thick, shining(colour, hatch))),
    ];
}

/* The meshes of a part, by its kind; a wheel is a transparent thin disc, its rim and three spokes. */
const MESHES = {
    solid: (m, part) => [solidMesh(part)],
    face: (m, part) => [faceMesh(part)],
    curve: (m, { points, radius, colour, hatch }) => [lineMesh(points, radius, shining(colour, hatch))],
    profile: (m, part) => profileMeshes(part),
    bar: (m, { points, radius, colour, hatch }) => [barMesh(points, radius, shining(colour, hatch))],
    ball: (m, { points, radius, colour, hatch }) => [ballMesh(points[0], radius, shining(colour, hatch))],
    stop: (m, part) => [stopMesh(part)],
    box: (m, { points, radius, colour, hatch }) => [meshAt(new THREE.BoxBufferGeometry(3 * radius, 2 * radius, 2 * radius), shining(colour, hatch), points[0])],
    pin: (m, { points: [at], colour }) => [
        meshAt(new THREE.ConeBufferGeometry(3.6 * m.thick, 6 * m.thick, 24), shining(colour), sub(at, scaled(3 * m.thick, m.basis.up)), [0, 1, 0], m.basis.up),
        ballMesh(at, 1.75 * m.thick, shining(pinColour())),
    ],
    disc: (m, { disc, rim, colour, hatch }) => disc.tyre ? tyreMeshes(m, disc, rim, colour, hatch) : [
        tubeMesh(rim, true, 2 * rim.length, (disc.teeth ? 0.3 : 0.7) * m.thick, shining(colour, hatch)),
        ...(disc.ring ? [] : [
            meshAt(new THREE.CylinderBufferGeometry(disc.radius, disc.radius, m.thick, 48), transparent(colour, 0.35), disc.at, [0, 1, 0], disc.axis),
            ...discSpokes(rim).map((end) => barMesh([disc.at, end], 0.5 * m.thick, shining(colour, hatch))),
        ]),
    ],
};

/* Without solids the ends of bars are rounded. */
function bodyGroup(m, b) {
    /*FLEXIBLE*/ if (m.picture.bodies[b].of) return placeGroup(m, b);
    const group = new THREE.Group(), shape = m.shapes[b], knots = b === 0 || shape.solids.length > 0 ? [] : shape.points;
    for (const part of partsOf(m, b)) group.add(...MESHES[part.kind](m, part));
    for (const at of knots) group.add(ballMesh(at, 1.02 * m.thick, shining(bodyColour(b), hatchOf(b))));
    return group;
}

function buildScene(m) {
    const scene = new THREE.Scene(), key = new THREE.DirectionalLight(0xffffff, 0.75), fill = new THREE.DirectionalLight(0xffffff, 0.3);
    const groups = m.shapes.map((_, b) => bodyGroup(m, b)), material = shining(groundColour());
    const lines = m.lines.map((line) => (line.rod ? barMesh([[0, 0, -0.5], [0, 0, 0.5]], 0.7 * m.thick, material) : springMesh(2.4 * m.thick, 0.4 * m.thick, material)));
    /*FLEXIBLE*/ dressPieces(m, lines);
    const ropes = m.ropes.map(() => new THREE.Mesh(new THREE.BufferGeometry(), shining(ropeColour())));
    for (const path of m.paths) {
        const geometry = new THREE.BufferGeometry().setFromPoints(path.points.map(vector));
        scene.add(new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: bodyColour(path.b), transparent: true, opacity: 0.55 })));
    }
    scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 0.55), key, fill, ...groups, ...lines, ...ropes);
    return { scene, key, fill, groups, lines, ropes };
}

/* A rod is a unit cylinder about its middle along y, turned to z when made; a spring begins at its first end. */
function placeLine(mesh, line, poses) {
    const [a, b] = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
    const length = Math.max(norm(sub(b, a)), 1e-9);
    mesh.position.copy(vector(line.rod ? scaled(0.5, add(a, b)) : a));
    mesh.quaternion.copy(alongAxis(line.rod ? [0, 1, 0] : [0, 0, 1], sub(b, a)));
    mesh.scale.set(1, line.rod ? length : 1, line.rod ? 1 : length);
}

/* A rope changes its shape: its tube is made again. */
function placeRope(mesh, rope, m, poses) {
    const points = ropePoints(rope, poses, m.ropes), curve = new THREE.CurvePath();
    for (let k = 1; k < points.length; k++) if (norm(sub(points[k], points[k - 1])) > 0) curve.add(new THREE.LineCurve3(vector(points[k - 1]), vector(points[k])));
    mesh.geometry.dispose();
    mesh.geometry = curve.curves.length > 0 ? new THREE.TubeBufferGeometry(curve, 4 * RIM, 0.35 * m.thick, 6) : new THREE.BufferGeometry();
}

function dispose(scene) {
    scene.traverse((object) => {
        if (object.geometry) object.geometry.dispose();
        if (object.material) object.material.dispose();
    });
}

/* Pages that show another mechanism on the same canvas give its renderer again. */
function glView(canvas, m, renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true })) {
    const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01 * m.size, 100 * m.size);
    let built = buildScene(m);
    return {
        kind: "webgl",
        renderer,
        end: () => dispose(built.scene),
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
            built.ropes.forEach((mesh, k) => placeRope(mesh, m.ropes[k], m, poses));
            /*FLEXIBLE*/ m.lines.forEach((line, k) => (built.lines[k].visible = !line.of || !view.hidden.has(line.of)));
            /*FLEXIBLE*/ colourPieces(m, built);
            renderer.render(built.scene, camera);
        },
    };
}
