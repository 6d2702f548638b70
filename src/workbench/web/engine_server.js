/* SPDX-License-Identifier: BSD-3-Clause */
/* The engine of the page: the server that `kempe workbench` has started (docs/workbench_protocol.md). Any object with these
 * functions can be the engine: src/browser/engine_wasm.js is another one. Without `drag` bodies cannot be dragged, without `save`
 * the file cannot be written. */
"use strict";

class ServerError extends Error {
    constructor(status, body) {
        super(body.error || `the server answered ${status}`);
        this.status = status;
        this.messages = body.messages || [];
    }
}

const pageEngine = {
    isPrivate: true, /* its address has a token, which others shall not get */
    saving: "Saving writes it to", /* the file */

    async ask(address, method = "GET", body = undefined) {
        const answer = await fetch(address, { method, cache: "no-store", ...(body ? { body: JSON.stringify(body), headers: { "Content-Type": "application/json" } } : {}) });
        const reply = answer.status === 204 ? null : await answer.json();
        if (!answer.ok && answer.status !== 409) throw new ServerError(answer.status, reply || {});
        return { status: answer.status, reply };
    },

    /* { name, path, text, version } of the file. */
    async read() {
        return (await this.ask("file")).reply;
    },

    /* The file once it differs from a version; null: not yet, ask again. */
    async changed(version) {
        return (await this.ask(`file?after=${version}`)).reply;
    },

    /* { version }, or { conflict: the file as it is now }. */
    async save(text, version) {
        const { status, reply } = await this.ask("file", "PUT", { text, version });
        return status === 409 ? { conflict: reply } : reply;
    },

    /* { code, text, messages, files } of the words of a command; files as bytes. `run`: a name for stop and progress. */
    async command(words, { files = {}, run } = {}) {
        const { reply } = await this.ask("command", "POST", { words, files, ...(run ? { run } : {}) });
        const written = Object.entries(reply.files).map(([name, text]) => [name, new Uint8Array(bytesOf(text))]);
        return { ...reply, files: Object.fromEntries(written) };
    },

    async progress(run) {
        return (await this.ask(`progress?run=${run}`)).reply.progress;
    },

    async stop(run) {
        return (await this.ask("stop", "POST", { run })).reply.stopped;
    },

    /* Messages of the Language Server Protocol, headers included, of a whole conversation, and those of the answer. */
    async language(messages) {
        const answer = await fetch("lsp", { method: "POST", cache: "no-store", body: messages });
        if (!answer.ok) throw new ServerError(answer.status, await answer.json());
        return answer.text();
    },

    /* { session, q, closure, distance, branch_changed, poses } of a point that is pulled to a target. */
    async drag(request) {
        return (await this.ask("drag", "POST", request)).reply;
    },
};
