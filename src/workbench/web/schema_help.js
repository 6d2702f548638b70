/* SPDX-License-Identifier: BSD-3-Clause */
/* Completion and explanations of the model language, from its JSON Schema and from the names in the text. */
"use strict";

let modelSchema = null; /* schema/kempe.schema.json; null: there is no help */

/* -- the schema --------------------------------------------------------------------------------------------- */

const definitionOf = (schema) => (schema.$ref ? { name: schema.$ref.split("/").pop(), ...modelSchema.definitions[schema.$ref.split("/").pop()], description: schema.description } : schema);

/* All readings of a value: of `anyOf` each one, without references. */
function readings(schema) {
    const own = definitionOf(schema);
    return [own, ...(own.anyOf || own.oneOf || []).flatMap((one) => readings({ ...one, description: one.description ?? own.description }))];
}

/* The schemas of an entry of a map, or of an item of a list. */
function schemasBelow(schemas, key) {
    return schemas.flatMap((schema) => readings(schema)).flatMap((schema) => {
        if (schema.properties && Object.hasOwn(schema.properties, key)) return [schema.properties[key]];
        if (schema.additionalProperties && typeof schema.additionalProperties === "object") return [schema.additionalProperties];
        if (Array.isArray(schema.items)) return schema.items[key] ? [schema.items[key]] : [];
        return schema.items ? [schema.items] : [];
    });
}

const schemasAt = (path) => (modelSchema ? path.reduce(schemasBelow, [modelSchema]) : []);

/* Links of the documentation as plain words. */
const described = (schema) => String(definitionOf(schema).description || "").replace(/\[([^\]]+)\]\([^)]*\)/g, "$1").replace(/`/g, "");

/* -- the cursor --------------------------------------------------------------------------------------------- */

const CURSOR = "__cursor__";

/* The path of the key at which the cursor is, or of the value: { path, key: boolean, word, from }. */
function cursorPath(text, offset) {
    const from = offset - /[\w.$:]*$/.exec(text.slice(0, offset))[0].replace(/^.*:(?!\w)/, "").length, to = offset + /^[\w.]*/.exec(text.slice(offset))[0].length, word = text.slice(from, offset);
    const find = (node, test, path = []) => {
        for (const { key, value, at } of node.entries || []) {
            if (test(key, value, at)) return [...path, key];
            const below = find(value, test, [...path, key]);
            if (below) return below;
        }
        return null;
    };
    const colon = /^\s*:(\s|$)/.test(text.slice(to)) ? "" : ": ", keyed = find(readYaml(text.slice(0, from) + CURSOR + colon + text.slice(to)), (key) => key === CURSOR);
    if (keyed) return { path: keyed.slice(0, -1), key: true, word, from };
    const marked = text.slice(0, from) + CURSOR + text.slice(to), valued = find(readYaml(marked), (key, value) => value.kind === "scalar" && marked.slice(value.start, value.end).includes(CURSOR));
    return valued ? { path: valued, key: false, word, from } : null;
}

/* -- names -------------------------------------------------------------------------------------------------- */

/* The names that a text declares, by what is expected. */
function declaredNames(text) {
    const tree = readYaml(text), at = (...path) => keysAt(tree, path), bodies = at("bodies"), scalar = (path) => {
        const node = nodeAt(tree, path);
        return node?.kind === "scalar" ? [text.slice(node.start, node.end)] : [];
    };
    const points = ["ground", ...at("ground", "points").map((name) => `ground.${name}`), ...bodies.flatMap((body) => [body, ...at("bodies", body, "points").map((name) => `${body}.${name}`)])];
    const joints = [...at("joints"), ...bodies.flatMap((body) => (nodeAt(tree, ["bodies", body, "joint"]) ? [scalar(["bodies", body, "joint", "name"])[0] ?? body] : []))];
    return { points, bodies: ["ground", ...bodies], joints, parameters: at("parameters"), tables: at("tables"), states: at("states") };
}

const NAMES_OF = { point_name: "points", body_name: "bodies", coordinate_name: "joints", joint_name: "joints", hinge_name: "joints", table_name: "tables", state_name: "states", number: "parameters" };

/* -- help --------------------------------------------------------------------------------------------------- */

/* { from, list: [{ text, about }] } of what may be typed at a place. */
function completionsAt(text, offset) {
    const place = modelSchema && cursorPath(text, offset);
    if (!place) return null;
    const found = new Map(), offer = (words, about) => words.toLowerCase().startsWith(place.word.toLowerCase()) && !found.has(words) && found.set(words, about);
    if (place.key) {
        const present = keysAt(readYaml(text), place.path);
        for (const schema of schemasAt(place.path).flatMap(readings)) for (const [key, value] of Object.entries(schema.properties || {})) if (!present.includes(key) || key === place.word) offer(`${key}: `, described(value));
    } else {
        const names = declaredNames(text);
        for (const schema of schemasAt(place.path).flatMap(readings)) {
            for (const word of schema.enum || []) if (typeof word === "string") offer(word, "");
            for (const name of names[NAMES_OF[schema.name]] || []) offer(name, NAMES_OF[schema.name] === "parameters" ? "parameter" : "");
        }
    }
    return { from: place.from, list: [...found].map(([words, about]) => ({ text: words, about })) };
}

/* The words for a place of the text: the meaning of its key, or where its name is declared. */
function explanationAt(text, offset) {
    const search = (node, path) => {
        for (const { key, at, value } of node.entries || []) {
            if (offset >= at && offset <= at + key.length && !/^\d+$/.test(key)) return { path: [...path, key], key };
            if (offset >= value.start && offset < value.end) return search(value, [...path, key]) || { path: [...path, key], value };
        }
        return null;
    };
    const tree = readYaml(text), found = search(tree, []);
    if (!found) return "";
    if (found.key) return [...new Set(schemasAt(found.path).map(described).filter(Boolean))].map((about) => `${found.key}: ${about}`)[0] || "";
    const word = /[\w.]*$/.exec(text.slice(0, offset))[0] + /^[\w.]*/.exec(text.slice(offset))[0], [body, point] = word.split(".");
    const declared = [["parameters", word], ["ground", "points", body === "ground" ? point : ""], ["bodies", body, "points", point ?? ""], ["joints", word], ["bodies", word]].map((path) => [path, nodeAt(tree, path)]).find(([, node]) => node && node.kind !== "empty");
    return declared && word ? `${word}: ${text.slice(declared[1].start, declared[1].end).replace(/\s+/g, " ").slice(0, 200)}` : "";
}
