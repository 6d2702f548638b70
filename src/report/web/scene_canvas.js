/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism on a plain canvas, where there is no WebGL: distant parts are drawn first. */
"use strict";

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

/* The faces of a solid that look at the viewer; the lines around them close the gaps between them. */
function solidJobs(part, colour, pose, view, see, depth) {
    const world = part.points.map((p) => moved(pose, p)), flat = world.map(see), away = world.map(depth);
    return part.triangles.flatMap((corners, k) => {
        const normal = turned(pose.q, part.faces[k]);
        if (dot(normal, view.out) <= 0) return [];
        const points = corners.map((p) => flat[p]), lit = litColour(colour, normal, view);
        return [{ depth: corners.reduce((sum, p) => sum + away[p], 0) / 3 + part.lift, draw: (c) => {
            fillShape(c, points, lit, part.opacity);
            if (part.opacity === 1) strokeLine(c, [...points, points[0]], 1, lit);
        } }];
    });
}

/* Each kind of part, given its points in the view, those of a wheel's rim behind them, and px(length) in pixels. */
const STROKES = {
    bar: (c, { radius, colour }, points, px) => strokeLine(c, points, px(2 * radius), colour),
    ball: (c, { radius, colour }, [at], px) => fillDisc(c, at, px(radius), colour),
    face: (c, { colour }, points) => fillShape(c, points, colour, 0.25),
    curve: (c, { radius, colour }, points, px) => strokeLine(c, points, px(2 * radius), colour),
    profile: (c, { colour }, points) => fillShape(c, points, colour, 0.3),
    box: (c, { colour }, points) => fillShape(c, points, colour, 1),
    stop: (c, { radius }, [at], px) => ringAround(c, at, px(radius)),
    pin: (c, { colour }, [[x, y]], px, m) => {
        const high = px(6 * m.thick);
        fillShape(c, [[x, y], [x - 0.6 * high, y + high], [x + 0.6 * high, y + high]], colour, 1);
        fillDisc(c, [x, y], px(1.75 * m.thick), pinColour());
    },
    disc: (c, { disc, colour }, [at, ...rim], px, m) => {
        if (!disc.ring) fillShape(c, rim, colour, 0.2);
        if (disc.tyre) strokeLine(c, [...rim, rim[0]].map((p) => middle(p, at, tyreThickness(disc) / disc.radius)), px(2 * tyreThickness(disc)), tyreColour());
        strokeLine(c, [...rim, rim[0]], px((disc.teeth ? 0.5 : 1.4) * m.thick), colour);
        if (disc.ring) return;
        for (const end of discSpokes(rim)) strokeLine(c, [at, end], px(m.thick), colour);
    },
};

/* A place of the view on the way to another one. */
const middle = ([x, y], [ax, ay], part) => [x + part * (ax - x), y + part * (ay - y)];

/* Colours with light lines across, or crossed ones: made once each, because a tile takes longer than the part that it fills. */
const hatchings = new Map();

function hatching(c, colour, hatch) {
    const key = `${colour} ${hatch}`;
    if (!hatchings.has(key)) hatchings.set(key, makeHatching(c, colour, hatch));
    return hatchings.get(key);
}

function makeHatching(c, colour, hatch) {
    const tile = document.createElement("canvas"), side = 8;
    tile.width = tile.height = side;
    const own = tile.getContext("2d");
    fillShape(own, [[0, 0], [side, 0], [side, side], [0, side]], colour, 1);
    for (const x of [-side, 0, side]) {
        strokeLine(own, [[x, side], [x + side, 0]], 2.5, "#ffffffbf");
        if (hatch === "crossed") strokeLine(own, [[x, 0], [x + side, side]], 2.5, "#ffffffbf");
    }
    return c.createPattern(tile, "repeat");
}

/* The corners of a slider's box, axes of its body. */
const boxCorners = ({ points: [at], radius }) => [[-1.5, -1], [1.5, -1], [1.5, 1], [-1.5, 1]].map(([x, y]) => add(at, scaled(radius, [x, y, 0])));

/* The drawn parts of a body, each with its depth, so that distant parts are drawn first. */
function bodyJobs(m, parts, pose, see, depth, view) {
    const px = (length) => length * view.scale;
    return parts.flatMap((part) => {
        if (part.kind === "solid") return solidJobs(part.solid, part.colour, pose, view, see, depth);
        const away = part.points.reduce((sum, p) => sum + depth(moved(pose, p)), 0) / part.points.length;
        const drawn = part.kind === "box" ? boxCorners(part) : [...part.points, ...(part.rim || [])];
        return [{ depth: away + part.lift, draw: (c) => STROKES[part.kind](c, part.hatch ? { ...part, colour: hatching(c, part.colour, part.hatch) } : part, drawn.map((p) => see(moved(pose, p))), px, m) }];
    });
}

function canvasView(canvas, m) {
    const c = canvas.getContext("2d"), partsOfAll = () => m.shapes.map((_, b) => partsOf(m, b));
    let parts = partsOfAll();
    return {
        kind: "canvas",
        rebuild: () => (parts = partsOfAll()),
        draw(poses, view) {
            const sharp = window.devicePixelRatio || 1, scale = view.scale;
            const depth = (p) => dot(p, view.out), see = projection(m, poses, view);
            canvas.width = Math.round(view.width * sharp);
            canvas.height = Math.round(view.height * sharp);
            c.scale(sharp, sharp);
            c.globalAlpha = 0.55;
            for (const path of m.paths) strokeLine(c, path.points.map(see), 1, bodyColour(path.b));
            c.globalAlpha = 1;
            const jobs = poses.flatMap((pose, b) => (view.hidden.has(b) ? [] : bodyJobs(m, parts[b], pose, see, depth, view)));
            for (const line of m.lines) {
                /*FLEXIBLE*/ if (line.of && !view.hidden.has(line.of)) jobs.push(pieceJob(m, line, poses, view, see, depth));
                /*FLEXIBLE*/ if (line.of) continue;
                const ends = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
                const path = line.rod ? ends.map(see) : zigzag(...ends.map(see), 2.4 * m.thick * scale);
                jobs.push({ depth: (depth(ends[0]) + depth(ends[1])) / 2, draw: () => strokeLine(c, path, (line.rod ? 1.4 : 0.8) * m.thick * scale, groundColour()) });
            }
            for (const rope of m.ropes) {
                const path = ropePoints(rope, poses, m.ropes);
                if (path.length > 0) jobs.push({ depth: Math.max(...path.map(depth)), draw: () => strokeLine(c, path.map(see), 0.7 * m.thick * scale, ropeColour()) });
            }
            jobs.sort((a, b) => a.depth - b.depth);
            for (const job of jobs) job.draw(c);
        },
    };
}
