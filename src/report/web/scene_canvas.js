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

/* The drawn parts of a body, each with its depth, so that distant parts are drawn first. */
function bodyJobs(m, b, pose, see, depth, view) {
    const shape = m.shapes[b], colour = bodyColour(b), jobs = [], world = shape.points.map((p) => moved(pose, p)), scale = view.scale;
    const middle = (list) => list.reduce((sum, p) => sum + depth(p), 0) / list.length;
    const push = (at, draw) => jobs.push({ depth: at, draw });
    for (const part of shape.solids) jobs.push(...solidJobs(part, solidColour(part, b), pose, view, see, depth));
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
            for (const guide of m.guides) strokeLine(c, guideEnds(m, guide).map((p) => see(moved(poses[guide.body], p))), 0.7 * m.thick * scale, groundColour());
            drawPins(c, m, see, scale);
            for (const rail of m.rails) strokeLine(c, rail.map(see), 1.6 * m.thick * scale, groundColour());
            c.globalAlpha = 0.55;
            for (const path of m.paths) strokeLine(c, path.points.map(see), 1, bodyColour(path.b));
            c.globalAlpha = 1;
            const jobs = poses.flatMap((pose, b) => (b === 0 || view.hidden.has(b) ? [] : bodyJobs(m, b, pose, see, depth, view)));
            for (const part of m.shapes[0].solids) jobs.push(...solidJobs(part, solidColour(part, 0), poses[0], view, see, depth));
            jobs.push(...discJobs(m, poses, see, depth, scale, view.hidden));
            for (const { body, ends } of m.barrels.filter((barrel) => !view.hidden.has(barrel.body))) {
                const [a, b] = ends.map((p) => moved(poses[body], p));
                jobs.push({ depth: (depth(a) + depth(b)) / 2 + 2 * m.thick, draw: () => strokeLine(c, [see(a), see(b)], 2 * BARREL * m.thick * scale, bodyColour(body)) });
            }
            for (const line of m.lines) {
                const ends = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
                const path = line.rod ? ends.map(see) : zigzag(...ends.map(see), 2.4 * m.thick * scale);
                jobs.push({ depth: (depth(ends[0]) + depth(ends[1])) / 2, draw: () => strokeLine(c, path, (line.rod ? 1.4 : 0.8) * m.thick * scale, groundColour()) });
            }
            jobs.sort((a, b) => a.depth - b.depth);
            for (const job of jobs) job.draw(c);
        },
    };
}
