/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of what the mouse draws, written as a person would: bars, pins, sliders, springs, motors, start values.
 * Each function takes the text and gives the new one; all other lines stay as they are.
 * A place is { world, body, point, local, axes }: world coordinates; the body it is on (null: empty space), its point of
 * that name (null: none there), the coordinates in the body, and the columns of the body's axes. */
"use strict";

const SECTIONS = ["kempe", "name", "include", "ports", "gravity", "parameters", "inputs", "states", "tables", "algebraic", "ground", "bodies", "joints", "loops", "drives", "forces", "outlines", "contacts",
    "profiles", "tracks", "wheels", "roads", "tyres", "bearings", "sensors", "start", "run"];
const ONE_LINE = ["start", "run", "gravity", "kempe", "name"];
const NEW_MODEL = "kempe: 1\nname: mechanism\ngravity: [0, -9.81, 0]\n";
const BAR_MASS = 1; /* kg per m of a new bar */

/* -- numbers ------------------------------------------------------------------------------------------------ */

const plain = (x, places = 4) => String(Number(x.toFixed(places)) || 0);
const pointText = (p) => `[${p.map((x) => plain(x)).join(", ")}]`;
const degrees = (radians) => (180 * radians) / Math.PI;

/* A mass or a stiffness as it is typed. */
const fewDigits = (x) => String(Number(x.toPrecision(2)));

/* -- names -------------------------------------------------------------------------------------------------- */

const isFree = (text, path, name) => !keysAt(readYaml(text), path).includes(name);

/* Joints with those of bodies, loops, drives, and bodies, whose coordinates may have their names. */
function jointNames(text) {
    const tree = readYaml(text), at = (...path) => keysAt(tree, path);
    const ofBodies = at("bodies").flatMap((body) => {
        const name = nodeAt(tree, ["bodies", body, "joint", "name"]);
        return name?.kind === "scalar" ? [text.slice(name.start, name.end)] : [];
    });
    return [...at("joints"), ...ofBodies, ...at("loops"), ...at("drives"), ...at("bodies")];
}

/* "bar1", "bar2", .. */
function numbered(text, path, stem, first = 1) {
    for (let k = first; ; k++) if (isFree(text, path, k === 0 ? stem : `${stem}${k}`)) return k === 0 ? stem : `${stem}${k}`;
}

/* The first capital letter that no point and no joint has; then P1, P2, .. */
function freshLetter(text) {
    const tree = readYaml(text), bodies = keysAt(tree, ["bodies"]), taken = new Set([...jointNames(text), ...keysAt(tree, ["ground", "points"]), ...bodies.flatMap((body) => keysAt(tree, ["bodies", body, "points"]))]);
    const letter = [..."ABCDEFGHIJKLMNOPQRSTUVWXYZ"].find((name) => !taken.has(name));
    for (let k = 1; !letter; k++) if (!taken.has(`P${k}`)) return `P${k}`;
    return letter;
}

/* -- sections ----------------------------------------------------------------------------------------------- */

/* A section that is missing comes before the first one that follows it in the usual order, with an empty line around it. */
function addSection(text, section, inner) {
    const tree = readYaml(text), later = tree.entries.find(({ key }) => SECTIONS.indexOf(key) > SECTIONS.indexOf(section));
    const words = ONE_LINE.includes(section) ? `${section}: {${inner}}` : `${section}:\n  ${inner}`;
    if (!later) return `${text.trimEnd()}${text.trim() ? "\n\n" : ""}${words}\n`;
    let at = later.at;
    while (/(^|\n)[ \t]*#[^\n]*\n$/.test(text.slice(0, at))) at = text.lastIndexOf("\n", at - 2) + 1; /* comments above it stay with it */
    return splice(text, at, at, `${words}\n\n`);
}

/* Sets an entry below a section. A new mapping in a section is on one line. */
function setEntry(text, path, words) {
    const inner = (keys) => keys.reduceRight((inside, key) => (inside === null ? `${key}: ${words}` : `${key}: {${inside}}`), null);
    const section = nodeAt(readYaml(text), path.slice(0, 1));
    if (!section) return addSection(text, path[0], inner(path.slice(1)));
    if (section.kind !== "map" || section.entries.length === 0) {
        const added = ONE_LINE.includes(path[0]) ? ` {${inner(path.slice(1))}}` : `\n  ${inner(path.slice(1))}`, from = text.lastIndexOf(":", section.start) + 1;
        return splice(text, from, section.end, added);
    }
    return putEntry(text, path, words);
}

const begun = (text) => (text.trim() ? text : NEW_MODEL);

/* A body with several lines. */
function addBody(text, name, lines) {
    const bodies = nodeAt(readYaml(text), ["bodies"]), indent = bodies?.entries?.length > 0 && !bodies.flow ? bodies.indent : 2, pad = " ".repeat(indent);
    if (bodies?.flow && bodies.entries.length > 0) return putEntry(text, ["bodies", name], `{${lines.join(", ")}}`);
    return setEntry(text, ["bodies", name], `\n${lines.map((line) => `${pad}  ${line}`).join("\n")}`).replace(`${name}: \n`, () => `${name}:\n`);
}

/* -- points and joints -------------------------------------------------------------------------------------- */

/* [text, name]: the place has a point of its body by then, or one of the ground in empty space. */
function withPoint(text, place, wish = null) {
    if (place.point) return [text, place.point];
    const name = wish ?? freshLetter(text), ground = place.body === null || place.body === "ground";
    const path = ground ? ["ground", "points", name] : ["bodies", place.body, "points", name];
    return [setEntry(text, path, pointText(ground ? place.world : place.local)), name];
}

const bodyOf = (place) => place.body ?? "ground";
const endText = (place, point) => (point === "" ? bodyOf(place) : `${bodyOf(place)}.${point}`);

/* A joint between two ends; its name is the one of the point where that is free. */
function addJoint(text, wish, kind, ends, more = "") {
    const name = !jointNames(text).includes(wish) ? wish : numbered(text, ["joints"], wish, 2);
    return [setEntry(text, ["joints", name], `{${kind}: [${ends.join(", ")}]${more}}`), name];
}

const axisText = (normal) => (normal === "z" ? "" : `, axis: ${normal}`);

/* -- tools -------------------------------------------------------------------------------------------------- */

/* Coordinates in axes whose columns are given. */
const inAxes = (axes, v) => axes.map((axis) => dot(axis, v));
const GROUND_AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/* A bar from a place to another one. Its axes are those of the first body, so that its angle there is zero as drawn; in empty
 * space its first end is pinned to the ground, its second one is free. Returns [text, name of the bar]. */
function addBar(given, from, to, { normal = "z", angle = () => 0 } = {}) {
    let text = begun(given), first, joint;
    const name = numbered(text, ["bodies"], "bar"), axes = from.axes ?? GROUND_AXES, reach = inAxes(axes, sub(to.world, from.world));
    [text, first] = withPoint(text, from);
    const start = first || freshLetter(text);
    let end = to.point || freshLetter(text);
    if (to.body !== null && !to.point) [text, end] = withPoint(text, to);
    if (end === start) end = `${start}2`; /* both ends are points of one name on two bodies */
    const mass = fewDigits(Math.max(BAR_MASS * norm(reach), 1e-3));
    text = addBody(text, name, [`points: {${start}: [0, 0, 0], ${end}: ${pointText(reach)}}`, `shape: {line: [${start}, ${end}], mass: ${mass}}`]);
    [text] = addJoint(text, start, "revolute", [endText(from, first), `${name}.${start}`], axisText(normal));
    if (to.body === null) return [text, name];
    [text, joint] = addJoint(text, end, "revolute", [endText(to, to.point ?? end), `${name}.${end}`], axisText(normal));
    const turn = angle(bodyOf(from)) - angle(bodyOf(to));
    if (Math.abs(turn) > 1e-4) text = setStart(text, { [joint]: { value: turn, angle: true } });
    return [text, name];
}

/* A ground point in empty space; a pin to the ground at a point of a body; a pin between two bodies whose points are at one place.
 * `others`: places of further bodies there. Returns [text, words]. */
function addPin(given, place, others, normal) {
    let text = begun(given), point, ground, joint;
    const other = others.find(({ body }) => body !== place.body);
    [text, point] = withPoint(text, place);
    if (place.body === null) return [text, `The ground has a point ${point}.`];
    if (other) {
        [text, joint] = addJoint(text, point, "revolute", [endText(place, point), endText(other, other.point)], axisText(normal));
        return [text, `${joint} pins ${place.body} and ${bodyOf(other)} together.`];
    }
    [text, ground] = withPoint(text, { world: place.world, body: null, point: null }, isFree(text, ["ground", "points"], point) ? point : null);
    [text, joint] = addJoint(text, point, "revolute", [`ground.${ground}`, endText(place, point)], axisText(normal));
    return [text, `${joint} pins ${place.body} to the ground.`];
}

/* A point of a body at a place of its own axes. Returns [text, its name]. */
function addPoint(text, body, local) {
    const name = freshLetter(text);
    return [setEntry(text, ["bodies", body, "points", name], pointText(local)), name];
}

/* Another place for a point of the ground whose coordinates are numbers; null: they are expressions, which the text has to change. */
function movePoint(text, point, world) {
    const node = nodeAt(readYaml(text), ["ground", "points", point]);
    return node && /^\[[-+.\d\s,e]*\]$/.test(text.slice(node.start, node.end)) ? setEntry(text, ["ground", "points", point], pointText(world)) : null;
}

/* The direction as an axis: a letter, or three numbers. */
function directionText(v) {
    const letter = ["x", "y", "z"].find((_, k) => Math.abs(Math.abs(unit(v)[k]) - 1) < 1e-6);
    return letter ?? pointText(unit(v));
}

/* A slider on a straight guide of the ground; it is pinned to the body of the place. Returns [text, its name]. */
function addSlider(given, place, direction, normal) {
    let text = begun(given), point, ground;
    const name = numbered(text, ["bodies"], "slider");
    if (place.body !== null && place.body !== "ground") [text, point] = withPoint(text, place);
    [text, ground] = withPoint(text, place.body === "ground" ? place : { world: place.world, body: null, point: null }, point && isFree(text, ["ground", "points"], point) ? point : null);
    const own = point ?? ground;
    text = addBody(text, name, ["mass: 1", `points: {${own}: [0, 0, 0]}`]);
    [text] = addJoint(text, `${name}_guide`, "prismatic", [`ground.${ground}`, `${name}.${own}`], `, axis: ${directionText(direction)}`);
    if (point) [text] = addJoint(text, point, "revolute", [endText(place, point), `${name}.${own}`], axisText(normal));
    return [text, name];
}

/* A spring between two places. Returns [text, its name]. */
function addSpring(given, from, to) {
    let text = begun(given), first, last;
    [text, first] = withPoint(text, from);
    [text, last] = withPoint(text, to);
    const name = numbered(text, ["forces"], "spring"), length = norm(sub(to.world, from.world));
    return [setEntry(text, ["forces", name], `{spring: [${endText(from, first)}, ${endText(to, last)}], stiffness: 1 kN/m, damping: 10, free_length: ${fewDigits(length)}}`), name];
}

/* A motor that turns a joint evenly from where it is, or moves a slider to and fro. Returns [text, its name]. */
function addMotor(given, coordinate, { value = 0, angle = true, size = 0.1 } = {}) {
    const name = jointNames(given).includes("motor") ? numbered(given, ["drives"], "motor", 2) : "motor";
    const from = angle ? plain(degrees(value), 1) : plain(1000 * value, 1), start = from === "0" ? "" : `${from} ${angle ? "deg" : "mm"} + `;
    const law = angle ? `angle: ${start}60 rpm*t` : `displacement: ${start}${fewDigits(250 * size)} mm*sin(360 deg/s*t)`;
    return [setEntry(given, ["drives", name], `{joint: ${coordinate}, ${law}}`), name];
}

/* -- removal ------------------------------------------------------------------------------------------------ */

const CONNECTIONS = ["joints", "loops", "forces", "drives", "contacts"];

/* True if the words of a value name a thing, other than as a key. */
const isNamed = (words, name) => words.replace(/#.*$/gm, "").split(/[\s,[\]{}]+/).some((word, k, all) => [name, `"${name}"`, `'${name}'`].includes(word.split(".")[0]) && !word.endsWith(":"));

/* [section, name] of the entries whose values name one of some things. */
function entriesNaming(text, sections, names) {
    const tree = readYaml(text);
    return sections.flatMap((section) => (nodeAt(tree, [section])?.entries || []).filter(({ value }) => names.some((name) => isNamed(text.slice(value.start, value.end), name))).map(({ key }) => [section, key]));
}

/* Bodies that have no joint, neither their own nor one of the section. */
function looseBodies(text) {
    const tree = readYaml(text);
    return keysAt(tree, ["bodies"]).filter((body) => !nodeAt(tree, ["bodies", body, "joint"]) && entriesNaming(text, ["joints"], [body]).length === 0);
}

const dropAll = (text, paths) => paths.reduce((left, path) => dropWhole(left, path), text);

/* Without drives and start values of joints that are removed. */
function dropJointUses(text, coordinates) {
    const drives = entriesNaming(text, ["drives"], coordinates), tree = readYaml(text);
    return dropAll(text, [...drives, ...["q", "qd"].flatMap((key) => coordinates.filter((name) => keysAt(tree, ["start", key]).includes(name)).map((name) => ["start", key, name]))]);
}

/* [text, words] without a part { kind, name, coordinates } and without what is joined to it. The kind is "body", "joint", "force" or "drive". A part
 * stays where another body would have no joint without it: the words name that body. */
function removePart(given, { kind, name, coordinates = [name] }) {
    const tree = readYaml(given), has = (...path) => nodeAt(tree, path) !== undefined, refused = (words) => [given, words];
    let text = given;
    if (kind === "body") {
        if (!has("bodies", name)) return refused(`${name} is not in the section bodies of this text.`);
        const child = keysAt(tree, ["bodies"]).find((body) => {
            const joint = nodeAt(tree, ["bodies", body, "joint"]);
            return body !== name && joint && isNamed(given.slice(joint.start, joint.end), name);
        });
        if (child) return refused(`${child} hangs on ${name}: delete ${child} first.`);
        const own = nodeAt(tree, ["bodies", name, "joint", "name"]), joints = entriesNaming(given, ["joints", "loops"], [name]);
        text = dropJointUses(text, [...joints.map(([, joint]) => joint), own ? given.slice(own.start, own.end) : name, ...coordinates]);
        text = dropAll(text, [["bodies", name], ...entriesNaming(text, CONNECTIONS, [name])]);
    } else if (kind === "joint") {
        const section = ["joints", "loops"].find((one) => has(one, name));
        if (!section) return refused(`${name} is written with its body: delete the body, or change its joint in the text.`);
        text = dropAll(dropJointUses(text, [...new Set([name, ...coordinates])]), [[section, name]]);
    } else {
        const section = kind === "drive" ? "drives" : "forces";
        if (!has(section, name)) return refused(`${name} is not in the section ${section} of this text.`);
        text = dropAll(text, [[section, name]]);
    }
    const [loose] = looseBodies(text).filter((body) => !looseBodies(given).includes(body));
    return loose ? refused(`${loose} would have no joint: delete it first.`) : [text, `${name} is deleted. Undo brings it back.`];
}

/* -- start values and parameters ---------------------------------------------------------------------------- */

const nameText = (name) => (/^[\w]+$/.test(name) ? name : JSON.stringify(name));

/* Start values of coordinates, { value, angle }: as many decimals as a drawing has; loops are closed from there. */
function setStart(given, values) {
    return Object.entries(values).reduce((text, [name, { value, angle }]) => setEntry(text, ["start", "q", nameText(name)], angle ? `${plain(degrees(value), 2)} deg` : plain(value, 5)), given);
}

const setParameter = (text, name, words) => setEntry(text, ["parameters", name], words);

/* -- one change of an editor -------------------------------------------------------------------------------- */

/* The part in which two texts differ: offsets in the first one, and the words of the second one. */
function differenceOf(before, after) {
    let from = 0, tail = 0;
    while (from < before.length && from < after.length && before[from] === after[from]) from++;
    while (tail < before.length - from && tail < after.length - from && before[before.length - 1 - tail] === after[after.length - 1 - tail]) tail++;
    return { from, to: before.length - tail, words: after.slice(from, after.length - tail) };
}
