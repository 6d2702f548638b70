/* SPDX-License-Identifier: BSD-3-Clause */
/* The engine of the workbench as a page without a server: Kempe as WebAssembly (javascript/kempe.mjs). It has the functions of
 * src/workbench/web/engine_server.js. The model is the one of the page; saving gives it to the browser as a download. */
"use strict";

const pageEngine = {
    isPrivate: false, /* its address contains nothing secret */
    saving: "Saving downloads it as", /* a file of the browser */
    workers: null, /* of checks and dragging, and of studies, which may take long */
    runs: new Map(), /* { worker, control, progress } by name */

    /* The worker of checks; that of studies begins with the first study. */
    async worker(run) {
        this.workers ??= { checks: Kempe.start(), studies: null };
        const { checks } = this.workers;
        if (run !== "study" && run !== "file") return checks;
        this.workers.studies ??= checks.then((kempe) => kempe.another());
        return this.workers.studies;
    },

    holdsFiles: true, /* the page may have several files: there is no folder */

    async read() {
        await this.worker("check");
        const file = JSON.parse(byId("first-model").textContent);
        return { ...file, path: `/model/${file.name}`, version: 1 };
    },

    async save(text, version) {
        saveFile(bench.name, text, "text/yaml");
        for (const [name, file] of bench.others) {
            if (file.text !== undefined && file.text !== file.saved) saveFile(name.split("/").pop(), file.text, "text/plain");
            file.saved = file.text;
        }
        return { version: version + 1 };
    },

    async command(words, { files = {}, run } = {}) {
        const worker = await this.worker(run), control = new AbortController(), own = { worker, control, progress: null };
        this.runs.set(run, own);
        try {
            return await worker.command(words, { files, signal: control.signal, onProgress: (progress) => (own.progress = progress) });
        } finally {
            if (this.runs.get(run) === own) this.runs.delete(run);
        }
    },

    async progress(run) {
        return this.runs.get(run)?.progress ?? null;
    },

    /* A page that is opened as a file shares no memory with its workers: the computation ends without a result. */
    async stop(run) {
        const own = this.runs.get(run);
        if (own && !own.worker.stop()) own.control.abort(new Error("the computation was stopped; this page keeps no result of it, as `kempe workbench` does"));
        return Boolean(own);
    },

    async language(messages) {
        return (await this.worker("language")).language(messages, { files: modelFiles() });
    },

    async drag(request) {
        return (await this.worker("drag")).drag(request, request.text === null ? {} : { files: otherFiles() });
    },
};
