// SPDX-License-Identifier: BSD-3-Clause
// What the plots of a live page can show, and what they show at first: for the page, and for its first run (first_runs.mjs).
"use strict";

/* Choices of the columns of a table: all of a kind with one unit, `most` at most, then each alone. */
function plotChoices(table, most) {
    const choices = new Map(), kind = (name) => `${name.includes(".") ? name.split(".")[0] : name} [${table.unit(name) || "1"}]`;
    const names = table.names.filter((name) => name !== "t" && table.column(name) instanceof Float64Array);
    for (const name of names) choices.set(kind(name), [...(choices.get(kind(name)) ?? []), name]);
    for (const [key, own] of choices) if (own.length > most) choices.set(key, own.slice(0, most));
    for (const name of names) if (choices.get(kind(name)).length > 1 || choices.get(kind(name))[0] !== name) choices.set(name, [name]);
    return choices;
}

/* The two that are shown at first. */
function firstChoices(choices) {
    const kinds = [...choices.keys()].filter((key) => key.endsWith("]")), states = /^(q|qd|qdd|lambda) /;
    return [...new Set([...kinds.filter((key) => !states.test(key)), ...kinds])].slice(0, 2);
}
