/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism as shapes: positions of its bodies at a time, their shapes, and the viewpoint. */
"use strict";

const MARK = { joint: 1, closure: 2, com: 4, named: 8, slide: 16, hinge: 32 };

/* -- vectors ------------------------------------------------------------------------------------------------ */

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (s, a) => [s * a[0], s * a[1], s * a[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(...a);
const unit = (a) => scaled(1 / (norm(a) || 1), a);

/* v turned by the unit quaternion x, y, z, w. */
function turned(q, v) {
    const axis = [q[0], q[1], q[2]], t = scaled(2, cross(axis, v));
    return add(add(v, scaled(q[3], t)), cross(axis, t));
}

const moved = (pose, v) => add(pose.p, turned(pose.q, v));

/* -- frames ------------------------------------------------------------------------------------------------- */

/* The frame of a time, and the part of the way to the next one. */
function frameAt(frames, t) {
    if (!(frames.t_end > frames.t_start)) return 0;
    if (data.separate) return Math.round(t - frames.t_start);
    if (!frames.t) return Math.min(Math.max((t - frames.t_start) / (frames.t_end - frames.t_start), 0), 1) * (frames.count - 1);
    const [low, , part] = placeIn(frames.t, t);
    return low + part;
}

/* The time of one of several shots, evenly spaced. */
const timeOfShot = ({ frames }, shot, shots) => frames.t_start + ((frames.t_end - frames.t_start) * shot) / Math.max(shots - 1, 1);

/* Poses of all bodies at a time, between two frames as between their neighbours. */
function makeMotion(picture) {
    const frames = picture.frames, moving = picture.bodies.length - 1;
    const position = shortsOf(frames.position), rotation = shortsOf(frames.rotation);
    const still = { p: [0, 0, 0], q: [0, 0, 0, 1] };
    return (t) => {
        const at = frameAt(frames, t);
        const first = Math.min(Math.floor(at), Math.max(frames.count - 2, 0)), part = at - first;
        const second = Math.min(first + 1, frames.count - 1);
        const poses = [still];
        for (let b = 0; b < moving; b++) {
            const i = first * moving + b, j = second * moving + b;
            const p = [0, 1, 2].map((k) => frames.middle[k] + frames.unit * ((1 - part) * position[3 * i + k] + part * position[3 * j + k]));
            const q = [0, 1, 2, 3].map((k) => (1 - part) * rotation[4 * i + k] + part * rotation[4 * j + k]);
            const length = Math.hypot(...q);
            poses.push({ p, q: q.map((x) => x / length) });
        }
        /*FLEXIBLE*/ deform(picture, poses, first, second, part);
        return poses;
    };
}

/* -- hulls -------------------------------------------------------------------------------------------------- */

const FLAT = 2e-3; /* of a body's size: flatter shapes count as planar */

/* The corners of the convex hull, in order, of points in the plane perpendicular to `normal` (Andrew 1979). */
function planeHull(points, members, normal) {
    const x = unit(sub(points[members[1]], points[members[0]])), y = cross(normal, x);
    const flat = members.map((k) => ({ k, x: dot(points[k], x), y: dot(points[k], y) }));
    flat.sort((a, b) => a.x - b.x || a.y - b.y);
    const half = (list) => {
        const chain = [];
        for (const p of list) {
            while (chain.length > 1) {
                const [a, b] = chain.slice(-2);
                if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0) break;
                chain.pop();
            }
            chain.push(p);
        }
        return chain.slice(0, -1);
    };
    return [...half(flat), ...half(flat.reverse())].map((p) => p.k);
}

function addEdges(shape, corners) {
    corners.forEach((a, k) => {
        const b = corners[(k + 1) % corners.length];
        if (!shape.bars.some(([c, d]) => (c === a && d === b) || (c === b && d === a))) shape.bars.push([a, b]);
    });
}

/* Every plane through three points that has all others on one side is a face. */
function addFaces(shape, points, size) {
    const seen = new Set(), n = points.length;
    for (let i = 0; i < n; i++)
        for (let j = i + 1; j < n; j++)
            for (let k = j + 1; k < n; k++) {
                const across = cross(sub(points[j], points[i]), sub(points[k], points[i]));
                if (norm(across) < 1e-6 * size * size) continue;
                const normal = unit(across), heights = points.map((p) => dot(sub(p, points[i]), normal));
                if (Math.max(...heights) > FLAT * size && Math.min(...heights) < -FLAT * size) continue;
                const members = points.map((p, l) => l).filter((l) => Math.abs(heights[l]) <= FLAT * size);
                if (seen.has(members.join())) continue;
                seen.add(members.join());
                const corners = planeHull(points, members, normal);
                shape.faces.push(corners);
                addEdges(shape, corners);
            }
}

/* Bars and faces between the points of a body: a bar when they are in line, a plate when they are in a plane. */
function hullOf(points) {
    const shape = { points, bars: [], faces: [] };
    if (points.length < 2) return shape;
    let a = 0, b = 1, size = 0;
    points.forEach((p, i) => points.forEach((q, j) => {
        if (norm(sub(p, q)) > size * 1.000001) [a, b, size] = [i, j, norm(sub(p, q))];
    }));
    const along = unit(sub(points[b], points[a]));
    const offs = points.map((p) => cross(along, sub(p, points[a])));
    const widest = offs.reduce((best, v) => (norm(v) > norm(best) ? v : best));
    if (norm(widest) <= FLAT * size) {
        shape.bars.push([a, b]);
        return shape;
    }
    const normal = unit(widest);
    const plate = points.every((p) => Math.abs(dot(sub(p, points[a]), normal)) <= FLAT * size);
    if (plate) {
        const corners = planeHull(points, points.map((p, k) => k), normal);
        shape.faces.push(corners);
        addEdges(shape, corners);
    } else if (points.length <= 24) {
        addFaces(shape, points, size);
    } else {
        points.forEach((p, k) => k > 0 && shape.bars.push([0, k]));
    }
    return shape;
}

/* Points within a solid of the ground need no pin. */
function uncovered(pins, ground) {
    const within = (p, { bounds }) => p.every((x, i) => x >= bounds[0][i] - 1e-9 && x <= bounds[7][i] + 1e-9);
    return pins.filter((p) => !ground.solids.some((solid) => within(p, solid)));
}

/* Solids take the place of bars and faces; pins of joints stay. */
function withSolids(shape, body, thin, meshes) {
    const solids = solidsOf(body, thin, meshes), plain = { ...shape, solids, bounds: solids.flatMap((solid) => solid.bounds) };
    return solids.length === 0 ? plain : { ...plain, bars: [], faces: [], boxes: [], weights: [] };
}

/* The shape of a body: points of its joints, closures and names, or its centre of mass where there are no others. */
function shapeOf(body) {
    const own = body.points.filter((p) => p[3] & ~MARK.com);
    const used = own.length < 2 ? body.points : own;
    const shape = hullOf(used.map((p) => p.slice(0, 3)));
    const stopped = data.stopped_at || [];
    shape.stops = body.points.filter((p) => stopped.includes(p[4])).map((p) => p.slice(0, 3));
    shape.hinges = used.filter((p) => p[3] & MARK.hinge).map((p) => ({ at: p.slice(0, 3), axis: p.slice(5, 8) }));
    shape.balls = used.filter((p) => p[3] & (MARK.joint | MARK.closure) && !(p[3] & MARK.hinge)).map((p) => p.slice(0, 3));
    shape.boxes = used.filter((p) => p[3] & MARK.slide).map((p) => p.slice(0, 3));
    shape.weights = shape.bars.length === 0 || used.length > own.length ? body.points.filter((p) => p[3] & MARK.com).map((p) => p.slice(0, 3)) : [];
    return shape;
}

/* -- guides and cylinders ------------------------------------------------------------------------------------- */

/* A guide on a moving body that begins at a joint of it, and whose slider stays on one side, is a hydraulic cylinder: its
 * barrel ends before the shortest stroke, its rod reaches from there to the slider. Bodies with solids show their own. */
function isCylinder(guide, picture) {
    const [near, far] = guide.range.map(Math.abs).sort((a, b) => a - b), held = MARK.joint | MARK.closure;
    const begins = picture.bodies[guide.body].points.some((p) => p[3] & held && norm(sub(p.slice(0, 3), guide.at)) <= 1e-6 * far);
    return guide.body > 0 && guide.slider < picture.bodies.length && guide.range[0] * guide.range[1] > 0 && near > 0.12 * far && begins;
}

function withCylinders(picture, shapes) {
    const found = { guides: [], barrels: [], lines: [...picture.lines] }, isSolid = (b) => shapes[b] && shapes[b].solids.length > 0;
    for (const guide of picture.guides) {
        const along = (s) => add(guide.at, scaled(s, guide.axis)), near = Math.abs(guide.range[0]) < Math.abs(guide.range[1]) ? guide.range[0] : guide.range[1];
        if (!isCylinder(guide, picture)) {
            if (!isSolid(guide.body) || !isSolid(guide.slider)) found.guides.push(guide);
            continue;
        }
        if (!isSolid(guide.body)) found.barrels.push({ body: guide.body, ends: [guide.at, along(0.94 * near)] });
        if (!isSolid(guide.slider)) found.lines.push({ name: picture.bodies[guide.slider].name, rod: true, body: [guide.body, guide.slider], at: [along(0.5 * near), guide.end] });
        for (const b of [guide.body, guide.slider]) if (shapes[b].bars.length <= 1) Object.assign(shapes[b], { boxes: [], bars: [], weights: [] });
    }
    return found;
}

/* -- wheels ------------------------------------------------------------------------------------------------- */

const RIM = 48;

/* Points on a wheel's rim, axes of its body; of a gear four for each tooth, between the circles of its heads and feet. */
function discRim(disc) {
    const axis = unit(disc.axis), side = unit(cross(axis, Math.abs(axis[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])), up = cross(axis, side);
    const count = disc.teeth ? 4 * disc.teeth : RIM, module = disc.teeth ? (2 * disc.radius) / disc.teeth : 0;
    return Array.from({ length: count }, (_, k) => {
        const angle = (2 * Math.PI * k) / count, head = k % 4 < 2, out = head ? module : -1.25 * module;
        const radius = disc.radius + (disc.ring ? -out : out);
        return add(disc.at, add(scaled(radius * Math.cos(angle), side), scaled(radius * Math.sin(angle), up)));
    });
}

/* The radius of a tyre's section: files and models of tyres have none that pages need. */
const tyreThickness = ({ radius }) => 0.16 * radius;

const discSpokes = (rim) => [0, 1, 2].map((k) => rim[Math.floor((k * rim.length) / 3)]);

/* The axis of a rope, the centres of its places, and the directions of its spans, in the ground's axes. */
function ropeSpans({ places, closed, body, axis: own }, poses) {
    const count = places.length, centres = places.map((place) => moved(poses[place.body], place.at));
    const sphere = places.some(({ ball }) => ball), axis = sphere ? unit(cross(sub(centres[0], centres[1]), sub(centres[2], centres[1]))) : turned(poses[body].q, own);
    const signed = places.map((place) => place.turn * place.radius);
    const spans = Array.from({ length: closed ? count : count - 1 }, (_, k) => {
        const next = (k + 1) % count, whole = sub(centres[next], centres[k]), d = sub(whole, scaled(dot(whole, axis), axis)), p = signed[next] - signed[k];
        return scaled(1 / (dot(d, d) || 1), sub(scaled(Math.sqrt(Math.max(dot(d, d) - p * p, 0)), d), scaled(p, cross(axis, d))));
    });
    return { axis, centres, signed, spans };
}

/* A helix on a cylinder: points across its axis rise in proportion to their way. */
function risen(points, axis, first, last) {
    const height = (p) => dot(axis, p), flat = points.map((p) => sub(p, scaled(height(p), axis))), way = [0];
    for (let k = 1; k < flat.length; k++) way.push(way[k - 1] + norm(sub(flat[k], flat[k - 1])));
    flat.forEach((p, k) => (points[k] = add(p, scaled(height(first) + ((height(last) - height(first)) * way[k]) / way.at(-1), axis))));
}

/* Points along a rope in the ground's axes: its spans, and arcs on its sheaves by angles that are continuous from the start. From a
 * wheel with grip, where the next part of a belt begins, the rope goes on to it over less than a turn. */
function ropePoints(rope, poses, ropes) {
    const { places } = rope, count = places.length, points = [];
    if (count === 0) return points;
    const { axis, centres, signed, spans } = ropeSpans(rope, poses);
    /* The rim is to the right of a rope that turns left. */
    const rim = (k, along, angle) => {
        const side = scaled(-signed[k], cross(axis, along)), turned = places[k].turn * angle;
        return add(centres[k], add(scaled(Math.cos(turned), side), scaled(Math.sin(turned), cross(axis, side))));
    };
    const wrapAt = (k, into, out) => {
        const change = places[k].turn * Math.atan2(dot(axis, cross(into, out)), dot(into, out)) - places[k].wrap;
        return places[k].wrap + Math.atan2(Math.sin(change), Math.cos(change));
    };
    /* Without a sheave that the rope has left. */
    const left = places.findIndex(({ leaves }, k) => leaves && wrapAt(k, spans.at(k - 1), spans[k]) < 0);
    if (left >= 0) return ropePoints({ ...rope, places: places.filter((_, k) => k !== left) }, poses, ropes);
    const arc = (k, into, wrap) => {
        const steps = Math.max(1, Math.ceil((RIM * Math.abs(wrap)) / (2 * Math.PI)));
        for (let i = 0; i <= steps; i++) points.push(rim(k, into, (wrap * i) / steps));
    };
    places.forEach((place, k) => {
        const into = k > 0 || rope.closed ? spans.at(k - 1) : null, out = spans[k] || (rope.closed ? spans[0] : null);
        if (place.turn === 0) points.push(centres[k]);
        else if (!place.wraps) points.push(rim(k, out || into, 0));
        else arc(k, into, wrapAt(k, into, out));
    });
    if (places.some(({ helix }) => helix)) risen(points, axis, centres[0], centres.at(-1));
    if (rope.next >= 0 && ropes[rope.next].places.length > 0) {
        const into = spans.at(-1), [out] = ropeSpans(ropes[rope.next], poses).spans, angle = places.at(-1).turn * Math.atan2(dot(axis, cross(into, out)), dot(into, out));
        arc(count - 1, into, angle < 0 ? angle + 2 * Math.PI : angle);
    }
    return rope.closed ? [...points, points[0]] : points;
}

/* Pins in the ground: where it is joined, and where springs and rods end. */
function groundPoints(picture) {
    const pins = picture.bodies[0].points.filter((p) => p[3] & (MARK.joint | MARK.closure)).map((p) => p.slice(0, 3));
    for (const line of picture.lines)
        line.body.forEach((body, k) => {
            if (body === 0 && !pins.some((p) => norm(sub(p, line.at[k])) === 0)) pins.push(line.at[k]);
        });
    return pins;
}

/* The paths of named free points, as coupler curves. */
function pathsOf(picture) {
    const motion = makeMotion(picture), paths = [], count = picture.frames.count;
    const free = picture.bodies.flatMap((body, b) => body.points.filter((p) => b > 0 && p[3] & MARK.named && !(p[3] & (MARK.joint | MARK.closure | MARK.slide))).map((p) => ({ b, at: p.slice(0, 3), points: [] })));
    const ends = (path) => picture.lines.some((line) => line.body.some((body, k) => body === path.b && norm(sub(line.at[k], path.at)) === 0));
    for (const path of free.slice(0, 6)) if (!ends(path)) paths.push(path);
    for (let f = 0; f < count && paths.length > 0; f++) {
        const poses = motion(timeOfShot(picture, f, count));
        for (const path of paths) path.points.push(moved(poses[path.b], path.at));
    }
    /*FLEXIBLE*/ for (const path of paths) path.b = picture.bodies[path.b].of || path.b;
    return paths;
}

/* -- surfaces ----------------------------------------------------------------------------------------------- */

const FLOOR = 0.12; /* of the size: what is seen of a plane beyond the bodies */

/* A sphere as a solid that one can look through. */
const sphereSolids = ({ radius, at }) => solidsOf({ solids: [{ kind: "sphere", radius, at, opacity: 0.45 }] }, 0, []);

/* Surfaces of contacts, and curves that points follow; the solids of a body show those that are not hollow. A cylinder is drawn
 * as a wheel is. */
function surfacesOf(picture, motion) {
    const found = [], discs = [...picture.discs], isShown = ({ body, hollow }) => picture.bodies[body].solids.length > 0 && !hollow;
    for (const surface of picture.surfaces) {
        if (surface.kind === "cylinder" && !isShown(surface)) discs.push(surface);
        else if (surface.kind === "sphere" && !isShown(surface)) found.push({ ...surface, solids: sphereSolids(surface) });
        else if (surface.kind === "path") found.push({ ...surface, kind: "curve", points: runOn(picture, motion, surface) });
        else if (!["cylinder", "sphere"].includes(surface.kind)) found.push(surface);
    }
    return { surfaces: found, discs };
}

/* Some points of the surfaces of a body that are in view. */
const cornersOf = ({ kind, points, others, solids }) =>
    solids ? solids[0].bounds : kind === "strip" ? [points, others].flatMap((list) => [list[0], list.at(-1)]) : kind === "curve" || kind === "pitch" ? points.filter((_, k) => k % 8 === 0) : [];

/* The places of a point that moves on a curve, in the axes of the curve's body. */
function runOn(picture, motion, { body, runner, end }) {
    const shots = Math.min(picture.frames.count, 120);
    return Array.from({ length: shots }, (_, f) => {
        const poses = motion(timeOfShot(picture, f, shots)), [x, y, z, w] = poses[body].q;
        return turned([-x, -y, -z, w], sub(moved(poses[runner], end), poses[body].p));
    });
}

/* The corners of the part of a plane below all that moves, axes of its body. */
function planeCorners({ body, at, axis }, tracks, size) {
    const [x, y] = axesAlong(axis), seen = body === 0 ? tracks.flat().map((p) => sub(p, at)) : [[0, 0, 0]];
    const range = (v) => seen.map((p) => dot(p, v)).reduce(([low, high], s) => [Math.min(low, s), Math.max(high, s)], [Infinity, -Infinity]);
    const [[a, b], [c, d]] = [x, y].map(range).map(([low, high]) => [low - FLOOR * size, high + FLOOR * size]);
    return [[a, c], [b, c], [b, d], [a, d]].map(([s, r]) => add(at, add(scaled(s, x), scaled(r, y))));
}

/* -- from where --------------------------------------------------------------------------------------------- */

/* World positions of all that is drawn, at some of the frames: of wheels a few points of their rims. */
function samplePoints(picture, motion, shapes, pins, discs, surfaces) {
    const tracks = [], shots = Math.min(picture.frames.count, 120);
    for (let f = 0; f < shots; f++) {
        const poses = motion(timeOfShot(picture, f, shots));
        let k = 0;
        shapes.forEach((shape, b) => {
            for (const p of b === 0 ? [] : [...shape.points, ...shape.bounds]) (tracks[k++] ||= []).push(moved(poses[b], p));
        });
        for (const disc of discs) for (const p of discRim(disc).filter((_, i) => i % 6 === 0)) (tracks[k++] ||= []).push(moved(poses[disc.body], p));
    }
    return [...tracks, ...pins.map((p) => [p]), ...groundTracks(shapes[0], surfaces, tracks)];
}

/* The greatest distance of points along an axis of the ground. */
function breadthOf(points) {
    return Math.max(...[0, 1, 2].map((i) => points.reduce((high, p) => Math.max(high, p[i]), -Infinity) - points.reduce((low, p) => Math.min(low, p[i]), Infinity)));
}

/* Solids and surfaces of the ground are in view unless they are much larger than the mechanism. */
function groundTracks(ground, surfaces, tracks) {
    const most = 1.6 * breadthOf(tracks.flat()), all = [...ground.solids.map(({ bounds }) => bounds), ...surfaces.filter(({ body }) => body === 0).map(cornersOf)];
    return all.filter((points) => points.length > 0 && !(breadthOf(points) > most)).flatMap((points) => points.map((p) => [p]));
}

/* The normal of the plane that all motion is parallel to; null when there is none. */
function planeOf(tracks) {
    let far = [0, 0, 0], across = [0, 0, 0];
    const offsets = tracks.flatMap((track) => track.map((p) => sub(p, track[0])));
    for (const v of offsets) if (norm(v) > norm(far)) far = v;
    for (const v of offsets) if (norm(cross(far, v)) > norm(across)) across = cross(far, v);
    const size = norm(far);
    if (size === 0) {
        const spread = tracks.map((track) => sub(track[0], tracks[0][0])).reduce((best, v) => (norm(v) > norm(best) ? v : best), far);
        return norm(spread) > 0 ? flatNormal(tracks, spread) : null;
    }
    if (norm(across) < 1e-3 * size * size) return flatNormal(tracks, far);
    const normal = unit(across);
    return offsets.every((v) => Math.abs(dot(v, normal)) < 1e-3 * size) ? normal : null;
}

/* The normal of the plane of a flat motion along one line, or without motion: perpendicular to it and to the rest of
 * the drawing. */
function flatNormal(tracks, along) {
    const origin = tracks[0][0], points = tracks.map((track) => sub(track[0], origin));
    const across = points.map((v) => cross(along, v)).reduce((best, v) => (norm(v) > norm(best) ? v : best), [0, 0, 0]);
    const size = Math.max(...points.map(norm), norm(along));
    if (norm(across) < 1e-3 * size * norm(along)) return Math.abs(along[2]) < 0.9 * norm(along) ? unit(cross(along, cross([0, 0, 1], along))) : [0, -1, 0];
    const normal = unit(across);
    return points.every((v) => Math.abs(dot(v, normal)) < 1e-3 * size) ? normal : null;
}

const across = (v, n) => sub(v, scaled(dot(v, n), n));

/* Right, up and towards the viewer. Up is against gravity where there is any, x goes to the right in a plane. */
function basisOf(picture, tracks) {
    const gravity = picture.gravity, normal = planeOf(tracks);
    if (!normal) {
        const up = norm(gravity) > 0 ? unit(scaled(-1, gravity)) : [0, 0, 1];
        const right = unit(across(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
        return { right, up, out: cross(right, up), planar: false };
    }
    const wishes = [scaled(-1, gravity), [0, 1, 0], [0, 0, 1]].map((v) => across(v, normal));
    const up = unit(wishes.find((v, k) => norm(v) > (k === 0 ? 0.3 * norm(gravity) || Infinity : 0.6)) || wishes[2]);
    let out = normal, right = cross(up, out);
    if (right[0] < -1e-9 || (Math.abs(right[0]) <= 1e-9 && right[1] < 0)) [out, right] = [scaled(-1, out), scaled(-1, right)];
    return { right, up, out, planar: true };
}

/* The camera's axes after turning about up, then about right. */
function turnedBasis(basis, yaw, pitch) {
    const level = add(scaled(Math.cos(yaw), basis.out), scaled(Math.sin(yaw), basis.right));
    return {
        right: sub(scaled(Math.cos(yaw), basis.right), scaled(Math.sin(yaw), basis.out)),
        out: add(scaled(Math.cos(pitch), level), scaled(Math.sin(pitch), basis.up)),
        up: sub(scaled(Math.cos(pitch), basis.up), scaled(Math.sin(pitch), level)),
    };
}

/* The extent that must be in view: centre, and half of its width and height for any rotation about up. */
function extentOf(basis, tracks, pitch) {
    const points = tracks.flat();
    const range = (axis) => {
        let low = Infinity, high = -Infinity;
        for (const p of points) {
            low = Math.min(low, dot(p, axis));
            high = Math.max(high, dot(p, axis));
        }
        return [(low + high) / 2, (high - low) / 2];
    };
    const [x, w] = range(basis.right), [y, h] = range(basis.up), [z] = range(basis.out);
    const centre = add(add(scaled(x, basis.right), scaled(y, basis.up)), scaled(z, basis.out));
    if (basis.planar) return { centre, width: w, height: h };
    let width = 0, height = 0;
    for (const p of points) {
        const v = sub(p, centre), high = dot(v, basis.up), wide = norm(sub(v, scaled(high, basis.up)));
        width = Math.max(width, wide);
        height = Math.max(height, Math.abs(high) * Math.cos(pitch) + wide * Math.sin(pitch));
    }
    return { centre, width, height };
}

/* The middle of all bodies' points at the given poses. */
function middleOf(shapes, discs, poses) {
    const points = shapes.flatMap((shape, b) => (b === 0 ? [] : shape.points.map((p) => moved(poses[b], p))));
    points.push(...discs.map((disc) => moved(poses[disc.body], disc.at)));
    return points.length > 0 ? scaled(1 / points.length, points.reduce(add, [0, 0, 0])) : [0, 0, 0];
}

/* If the mechanism moves several times its own size, the view follows it: returns the tracks relative to its middle,
 * without stationary parts. Otherwise null. */
function seenAlong(picture, motion, shapes, discs, tracks) {
    const moving = tracks.filter((track) => track.length > 1);
    const shots = moving.length > 0 ? moving[0].length : 0;
    const middles = Array.from({ length: shots }, (_, f) => middleOf(shapes, discs, motion(timeOfShot(picture, f, shots))));
    const seen = moving.map((track) => track.map((p, f) => sub(p, middles[f])));
    const longest = (vectors) => vectors.reduce((best, v) => Math.max(best, norm(v)), 0);
    const far = longest(middles.map((p) => sub(p, middles[0]))), wide = longest(seen.flat());
    return far > 4 * wide && wide > 0 ? seen : null;
}

/* -- parts -------------------------------------------------------------------------------------------------- */

/* The radius of a cylinder's barrel beside that of a bar. */
const BARREL = 1.7;

/* A slider is a box, a smaller one on a body with other shapes. */
const boxSize = (m, b) => (m.shapes[b].bars.length > 0 ? 3.3 : 5.5) * m.thick;

/* A hinge is a pin along its axis. */
const hingeEnds = (m, { at, axis }) => [-1, 1].map((s) => add(at, scaled(2.6 * s * m.thick, unit(axis))));

/* The ends of a guide, beyond its slider's range. */
const guideEnds = (m, guide) => [guide.range[0] - 5 * m.thick, guide.range[1] + 5 * m.thick].map((s) => add(guide.at, scaled(s, guide.axis)));

/* A plane is a face with edges, a strip of road likewise; a closed profile is filled, and as thick as a gear wheel; a curve is a line, the
 * pitch curve of a cam a thin one. */
function surfaceParts(m, { kind, points, others, axis, solids }, colour, lift) {
    const line = (list, radius) => ({ kind: "curve", points: list, radius: radius * m.thick, colour, lift });
    if (kind === "sphere") return solids.map((solid) => ({ kind: "solid", solid, colour }));
    if (kind === "plane") return [{ kind: "face", points, colour, lift: -1e6 * m.size }, line([...points, points[0]], 0.6)];
    if (kind === "strip") return [{ kind: "face", strip: true, points: [...points, ...[...others].reverse()], colour, lift }, line(points, 0.6), line(others, 0.6)];
    if (kind === "pitch") return [line(points, 0.2)];
    return axis ? [{ kind: "profile", points, axis, depth: 2 * m.thick, colour, lift }, line(points, 0.5)] : [line(points, 0.6)];
}

/* A sheave or a drum ends below its rope, which has the disc's radius. */
const underRope = (m, disc) => (disc.sheave ? { ...disc, radius: Math.max(0.8 * disc.radius, disc.radius - 1.05 * m.thick) } : disc);

/* The drawn parts of a body for either kind of drawing, axes of the body. `lift`: how much nearer to the viewer than its
 * points a part is sorted. */
function partsOf(m, b) {
    const shape = m.shapes[b], colour = bodyColour(b), pin = pinColour(), ground = groundColour(), t = m.thick, behind = -1e6 * m.size;
    const bar = (points, radius, own, lift = 0) => ({ kind: "bar", points, radius, colour: own, lift });
    const ball = (at, radius, own, lift) => ({ kind: "ball", points: [at], radius, colour: own, lift });
    const parts = shape.solids.map((solid) => ({ kind: "solid", solid, colour: solidColour(solid, b) }));
    parts.push(...m.guides.filter((guide) => guide.body === b).map((guide) => bar(guideEnds(m, guide), 0.35 * t, ground, behind)));
    const surfaces = m.surfaces.filter((surface) => surface.body === b).flatMap((surface) => surfaceParts(m, surface, colour, b === 0 ? behind : 0));
    const hatch = (part) => ({ ...part, hatch: part.colour === colour ? hatchOf(b) : "" });
    const discs = m.discs.filter((disc) => disc.body === b).map((disc) => underRope(m, disc)).map((disc) => ({ kind: "disc", points: [disc.at], disc, rim: discRim(disc), colour: b === 0 ? ground : colour, lift: b === 0 ? behind : 0 }));
    if (b === 0) return [...parts, ...surfaces, ...discs.filter(({ disc }) => disc.teeth || disc.sheave), ...m.pins.map((at) => ({ kind: "pin", points: [at], colour: ground, lift: behind })), ...m.rails.flatMap((rail) => rail.slice(1).map((p, k) => bar([rail[k], p], 0.8 * t, ground, behind)))];
    return [
        ...parts,
        ...surfaces,
        ...shape.faces.map((corners) => ({ kind: "face", points: corners.map((k) => shape.points[k]), colour, lift: 0 })),
        ...shape.bars.map(([i, j]) => bar([shape.points[i], shape.points[j]], t, colour)),
        ...shape.balls.map((at) => ball(at, 1.75 * t, pin, 3 * t)),
        ...shape.hinges.map((hinge) => bar(hingeEnds(m, hinge), 1.75 * t, pin, 3 * t)),
        ...shape.stops.map((at) => ({ kind: "stop", points: [at], radius: 4 * t, colour: STOP_COLOUR, lift: -behind })),
        ...shape.weights.map((at) => ball(at, 2.6 * t, colour, t)),
        ...shape.boxes.map((at) => ({ kind: "box", points: [at], radius: boxSize(m, b) / 2, colour, lift: t })),
        ...discs,
        ...m.barrels.filter((barrel) => barrel.body === b).map(({ ends }) => bar(ends, BARREL * t, colour, 2 * t)),
    ].map(hatch);
}

/* The data for either kind of drawing. `extent` is about the middle of the bodies when the view follows them. */
function makeMechanism(picture) {
    const motion = makeMotion(picture), plain = picture.bodies.map(shapeOf);
    const thin = 0.01 * breadthOf(plain.flatMap((shape) => shape.points)), shapes = picture.bodies.map((body, b) => withSolids(plain[b], body, thin, picture.meshes));
    const pins = uncovered(groundPoints(picture), shapes[0]);
    const { rails } = picture, { surfaces, discs } = surfacesOf(picture, motion);
    for (const surface of surfaces) if (surface.body > 0) shapes[surface.body] = { ...shapes[surface.body], bounds: [...shapes[surface.body].bounds, ...cornersOf(surface)] };
    const tracks = samplePoints(picture, motion, shapes, pins, discs, surfaces), basis = basisOf(picture, tracks);
    const home = basis.planar ? { yaw: 0, pitch: 0 } : { yaw: 0.6, pitch: 0.4 };
    const along = seenAlong(picture, motion, shapes, discs, tracks), extent = extentOf(basis, along || tracks, home.pitch);
    const centreAt = (poses) => (along ? add(extent.centre, middleOf(shapes, discs, poses)) : extent.centre);
    const size = Math.max(extent.width, extent.height) || 1;
    const lengths = plain.flatMap((shape, b) => (b === 0 ? [] : shape.bars.map(([i, j]) => norm(sub(shape.points[i], shape.points[j]))))).sort((a, b) => a - b);
    for (const plane of surfaces) if (plane.kind === "plane") plane.points = planeCorners(plane, tracks, size);
    const usual = lengths.length > 0 ? lengths[lengths.length >> 1] : size;
    return { picture, motion, shapes, ...withCylinders(picture, shapes), ropes: picture.ropes || [], pins, discs, surfaces, rails, paths: picture.pathless ? [] : pathsOf(picture), basis, home, extent, centreAt, follows: along !== null, size, thick: Math.max(Math.min(0.016 * size, 0.1 * usual), 0.004 * size) };
}
