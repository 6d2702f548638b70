/* SPDX-License-Identifier: BSD-3-Clause */
/* Contacts of a run: the path of a journal's centre in the circle of its clearance, and a histogram of the largest depths
 * of contacts. */
"use strict";

const BOX = { width: 420, height: 420, room: 34 };

/* A length with its unit in millimetres or micrometres. */
function lengthOf(x, unit) {
    if (unit !== "m") return `${three(x)} ${unit}`;
    return x >= 1e-4 ? `${three(1e3 * x)} mm` : `${three(1e6 * x)} \u00b5m`;
}

/* -- paths ------------------------------------------------------------------------------------------------- */

/* Lines of a path, those that touch apart: each begins at the last point of the one before. */
function pathLines(contact, x, y, place) {
    const lines = { free: "", touching: "" };
    let last = null;
    for (let k = 0; k < x.length; k++) {
        if (!isFinite(x[k]) || !isFinite(y[k])) continue;
        const kind = Math.hypot(x[k], y[k]) >= contact.clearance * (1 - 1e-7) ? "touching" : "free", [a, b] = place(x[k], y[k]);
        const point = `${a.toFixed(2)},${b.toFixed(2)}`;
        lines[kind] += last === null ? `M${point}` : last.kind === kind ? `L${point}` : `M${last.point}L${point}`;
        last = { kind, point };
    }
    return lines;
}

/* The circle has the radius of the clearance; a path that leaves it by more than its depths is drawn smaller. */
function pathPicture(contact) {
    const x = floatsOf(contact.x), y = floatsOf(contact.y);
    let reach = contact.clearance;
    for (let k = 0; k < x.length; k++) if (isFinite(x[k])) reach = Math.max(reach, Math.hypot(x[k], y[k]));
    const scale = (BOX.width / 2 - BOX.room) / reach, middle = BOX.width / 2, place = (a, b) => [middle + scale * a, middle - scale * b];
    const lines = pathLines(contact, x, y, place), start = place(x[0] || 0, y[0] || 0), r = scale * contact.clearance;
    return drawn2d(
        "svg",
        { class: "diagram", viewBox: `0 0 ${BOX.width} ${BOX.height}`, role: "img", "aria-label": `Path of the journal of ${contact.name}`, "data-points": x.length },
        drawn2d("path", { d: `M${middle - r - 12},${middle}H${middle + r + 12}M${middle},${middle - r - 12}V${middle + r + 12}` }),
        drawn2d("circle", { class: "clearance", cx: middle, cy: middle, r }),
        drawn2d("path", { class: "free", d: lines.free }),
        drawn2d("path", { class: "touching", d: lines.touching }),
        drawn2d("circle", { class: "start", cx: start[0], cy: start[1], r: 3.5 }),
        label2d("x", middle + r + 16, middle + 4, "start"),
        label2d("y", middle, middle - r - 17, "middle"),
        label2d(`circle: ${lengthOf(contact.clearance, "m")}`, 6, BOX.height - 8, "start"),
    );
}

/* -- depths ------------------------------------------------------------------------------------------------ */

function barsPicture(contact) {
    const { bars, quartiles } = contact.depths, place = { left: 40, right: BOX.width - 14, top: 16, foot: 250 }, deepest = quartiles[4];
    const { left, right, top, foot } = place, across = (depth) => left + ((right - left) * depth) / deepest;
    return drawn2d(
        "svg",
        { class: "diagram", viewBox: `0 0 ${BOX.width} 290`, role: "img", "aria-label": `Largest depths of the contacts of ${contact.name}`, "data-bars": bars.length },
        ...bars2d(bars, place, 1),
        drawn2d("path", { d: `M${left},${top}V${foot}H${right}` }),
        drawn2d("path", { class: "quartile", d: quartiles.slice(1, 4).map((depth) => `M${across(depth)},${foot}v-10`).join("") }),
        label2d(count(Math.max(...bars)), left - 6, top + 5, "end"),
        label2d("0", left - 6, foot + 4, "end"),
        label2d("0", left, foot + 18, "middle"),
        label2d(lengthOf(deepest, contact.unit), right, foot + 18, "end"),
        label2d("largest depth of a contact; marks: quartiles", (left + right) / 2, foot + 34, "middle"),
    );
}

function depthWords({ unit, depths: { began, ended, cut, touching, quartiles, turning, turns } }) {
    const words = [`${count(began)} contact${began === 1 ? "" : "s"} began${cut ? " in the part of the run whose contacts are kept" : ""}`];
    if (turning) words.push(`${(began / turns).toPrecision(3)} for each turn of ${turning}`);
    words.push(`touching for ${(100 * touching).toPrecision(3)} % of the time`);
    if (ended > 0) words.push(`largest depth ${lengthOf(quartiles[4], unit)}`);
    if (ended > 1) words.push(`median of the largest depths ${lengthOf(quartiles[2], unit)}`);
    return `${words.join(", ")}.`;
}

/* -- the section ------------------------------------------------------------------------------------------- */

function writeContacts() {
    const place = byId("contact-figures");
    byId("contacts").hidden = data.contacts.length === 0;
    byId("paths-note").hidden = !data.contacts.some((contact) => contact.x);
    for (const contact of data.contacts) {
        const figure = element("figure.card", element("figcaption", contact.name)), pictures = element("div.pair");
        if (contact.x) pictures.append(pathPicture(contact));
        if (contact.depths && contact.depths.ended > 0) pictures.append(barsPicture(contact));
        if (pictures.children.length > 0) figure.append(pictures);
        if (contact.depths) figure.append(element("p.note", depthWords(contact)));
        place.append(figure);
    }
}
