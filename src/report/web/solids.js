/* SPDX-License-Identifier: BSD-3-Clause */
/* Shapes of bodies as triangles, axes of the body, for either kind of drawing. */
"use strict";

const SIDES = 32; /* of a circle */
const CREASE = Math.cos(0.7); /* normals are common to faces that meet at a smaller angle */

const combined = (frame, [x, y, z]) => add(add(scaled(x, frame[0]), scaled(y, frame[1])), scaled(z, frame[2]));

/* Axes x, y, z of which the last one is given. */
function axesAlong(direction) {
    const z = unit(direction), x = unit(cross(Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], z));
    return [x, cross(z, x), z];
}

/* -- surfaces ----------------------------------------------------------------------------------------------- */

/* A profile of points [radius, height], from one end of the axis to the other, turned about z. */
function revolved(profile, sides = SIDES) {
    const points = [], triangles = [];
    const rings = profile.map(([radius, height]) => {
        const count = radius > 0 ? sides : 1, first = points.length;
        for (let k = 0; k < count; k++) points.push([radius * Math.cos((2 * Math.PI * k) / sides), radius * Math.sin((2 * Math.PI * k) / sides), height]);
        return { first, count };
    });
    rings.slice(1).forEach((upper, i) => {
        const lower = rings[i], at = (ring, k) => ring.first + (ring.count > 1 ? k % sides : 0);
        for (let k = 0; k < sides; k++) {
            if (lower.count > 1) triangles.push([at(lower, k), at(lower, k + 1), at(upper, k)]);
            if (upper.count > 1) triangles.push([at(lower, k + 1), at(upper, k + 1), at(upper, k)]);
        }
    });
    return { points, triangles };
}

/* Quarter circles from the pole below to the equator, and on to the pole above, `half` away from the middle. */
function rounded(radius, half) {
    const steps = SIDES / 4, lower = Array.from({ length: steps + 1 }, (_, k) => {
        const angle = (Math.PI / 2) * (k / steps);
        return [k === 0 ? 0 : radius * Math.sin(angle), -half - radius * Math.cos(angle)];
    });
    const upper = lower.map(([r, z]) => [r, -z]).reverse();
    return [...lower, ...pieces(radius, half), ...(half > 0 ? upper : upper.slice(1))];
}

/* Rings on a cylinder between its ends: short pieces are sorted well by their distance from the viewer. */
function pieces(radius, half) {
    const count = Math.min(Math.max(Math.ceil((2 * half) / (3 * radius)), 1), 16);
    return Array.from({ length: count - 1 }, (_, k) => [radius, half * ((2 * (k + 1)) / count - 1)]);
}

const cylinderProfile = (radius, half) => [[0, -half], [radius, -half], ...pieces(radius, half), [radius, half], [0, half]];

function cuboid(size) {
    const points = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].map((i) => ((k >> i) & 1 ? 0.5 : -0.5) * size[i]));
    const faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    return { points, triangles: faces.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]) };
}

function placed(surface, frame, at) {
    return { points: surface.points.map((p) => add(at, combined(frame, p))), triangles: surface.triangles };
}

function stretched(surface, factors) {
    return { points: surface.points.map((p) => p.map((x, i) => factors[i] * x)), triangles: surface.triangles };
}

function joined(surfaces) {
    const whole = { points: [], triangles: [] };
    for (const { points, triangles } of surfaces) {
        const first = whole.points.length;
        for (const p of points) whole.points.push(p);
        for (const t of triangles) whole.triangles.push(t.map((k) => k + first));
    }
    return whole;
}

/* A capsule from one place to another. */
function strut(a, b, radius) {
    return placed(revolved(rounded(radius, norm(sub(b, a)) / 2)), axesAlong(sub(b, a)), scaled(0.5, add(a, b)));
}

/* A mesh of the page, in the axes of its file, m. */
function meshSurface(mesh, scale) {
    const points = shortsOf(mesh.points), corners = new Uint16Array(bytesOf(mesh.corners));
    const triple = (list, k) => [list[3 * k], list[3 * k + 1], list[3 * k + 2]];
    return {
        points: Array.from({ length: points.length / 3 }, (_, k) => triple(points, k).map((x, i) => scale * (mesh.middle[i] + mesh.unit * x))),
        triangles: Array.from({ length: corners.length / 3 }, (_, k) => triple(corners, k)),
    };
}

/* `thin`: the radius of a line that has none. */
function surfaceOf(solid, thin, meshes) {
    const flat = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const round = { cylinder: cylinderProfile, capsule: rounded }[solid.kind];
    if (round) return placed(revolved(round(solid.radius, solid.length / 2)), axesAlong(solid.along), solid.at);
    if (solid.kind === "sphere") return placed(revolved(rounded(solid.radius, 0)), flat, solid.at);
    if (solid.kind === "ellipsoid") return placed(stretched(revolved(rounded(1, 0)), solid.radii), solid.axes || flat, solid.at);
    if (solid.kind === "mesh") return placed(meshSurface(meshes.find((mesh) => mesh.file === solid.file), solid.scale), solid.axes || flat, solid.at);
    if (solid.kind === "line") return joined(solid.through.slice(1).map((p, k) => strut(solid.through[k], p, solid.radius || thin)));
    return placed(cuboid(solid.size), solid.axes || flat, solid.at);
}

/* -- normals ------------------------------------------------------------------------------------------------ */

/* The normal of each triangle, and of each corner of it: the mean of those around its point that differ little. */
function normalsOf({ points, triangles }) {
    const across = triangles.map(([a, b, c]) => cross(sub(points[b], points[a]), sub(points[c], points[a])));
    const faces = across.map(unit), around = points.map(() => []);
    triangles.forEach((corners, k) => corners.forEach((p) => around[p].push(k)));
    const corners = triangles.flatMap((list, k) => list.map((p) => {
        const sum = [0, 0, 0];
        for (const other of around[p]) if (dot(faces[k], faces[other]) > CREASE) for (let i = 0; i < 3; i++) sum[i] += across[other][i];
        return unit(sum);
    }));
    return { faces, corners };
}

/* Of a round hole its two ends are seen: the triangles around either pole. */
function endsOf({ points, triangles }) {
    return { points, triangles: triangles.filter((corners) => corners.includes(0) || corners.includes(points.length - 1)) };
}

/* -- of a body ---------------------------------------------------------------------------------------------- */

/* Its solids as surfaces with normals and colours, the corners of their boxes, and how far towards the viewer a hole is lifted
 * where parts are sorted by their distance. */
function solidsOf(body, thin, meshes) {
    return body.solids.map((solid) => {
        const whole = surfaceOf(solid, thin, meshes), surface = solid.hole && solid.kind === "cylinder" ? endsOf(whole) : whole, low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
        for (const p of surface.points) for (let i = 0; i < 3; i++) [low[i], high[i]] = [Math.min(low[i], p[i]), Math.max(high[i], p[i])];
        const bounds = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => low.map((x, i) => ((k >> i) & 1 ? high[i] : x)));
        return { ...surface, ...normalsOf(surface), bounds, colour: solid.colour, opacity: solid.opacity ?? 1, hole: Boolean(solid.hole), lift: solid.hole ? 2 * (solid.radius || 0) : 0 };
    });
}

const HOLE_COLOUR = "#22282b";

/* The colour in which a solid of body b is drawn. */
const solidColour = (solid, b) => (solid.hole ? HOLE_COLOUR : solid.colour || bodyColour(b));

/* Light on a face: from the viewer, above and left of him. */
function litColour(colour, normal, view) {
    const light = unit(add(view.out, add(scaled(0.7, view.up), scaled(-0.5, view.right))));
    const share = 0.42 + 0.58 * Math.max(dot(normal, light), 0), rgb = parseInt(colour.slice(1), 16);
    return `rgb(${[16, 8, 0].map((bits) => Math.round(share * ((rgb >> bits) & 255))).join(",")})`;
}

/* The depth, towards the viewer, of a surface at a place of the view; -Infinity: the surface does not cover it. */
function coverAt(solid, [x, y], see, depth) {
    const seen = solid.points.map(see), away = solid.points.map(depth);
    let best = -Infinity;
    for (const [a, b, c] of solid.triangles) {
        const area = (p, q) => (seen[q][0] - seen[p][0]) * (y - seen[p][1]) - (seen[q][1] - seen[p][1]) * (x - seen[p][0]);
        const [u, v, w] = [area(b, c), area(c, a), area(a, b)], whole = u + v + w;
        if (whole !== 0 && u / whole >= 0 && v / whole >= 0 && w / whole >= 0) best = Math.max(best, (u * away[a] + v * away[b] + w * away[c]) / whole);
    }
    return best;
}
