// SPDX-License-Identifier: BSD-3-Clause
// Kempe in browsers and Node.js: a worker runs the command of WebAssembly, one call after another. kempe.d.ts describes all that is
// exported here, docs/javascript.md its use.

const FOLDER = "/model/";

/* -- tables ------------------------------------------------------------------------------------------- */

/** An array of NumPy's format .npy: numbers as Float64Array, texts as array of strings. */
function readArray(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const [length, start] = bytes[6] === 1 ? [view.getUint16(8, true), 10] : [view.getUint32(8, true), 12];
    const header = new TextDecoder("latin1").decode(bytes.subarray(start, start + length));
    const [, order, kind, width] = /'descr': *'([<|=])([a-zA-Z])(\d+)'/.exec(header);
    const shape = /'shape': *\(([^)]*)\)/.exec(header)[1].split(",").filter((word) => word.trim()).map(Number);
    const byColumns = /'fortran_order': *True/.test(header), data = bytes.slice(start + length);
    if (order !== "<" && order !== "|" && order !== "=") throw new Error(`array of another order of bytes: ${header}`);
    if (kind === "f" && width === "8") return { shape, byColumns, values: new Float64Array(data.buffer) };
    if (kind !== "U") throw new Error(`array of an unknown type: ${header}`);
    const codes = new Uint32Array(data.buffer), values = [];
    for (let at = 0; at < codes.length; at += Number(width)) {
        const word = codes.subarray(at, at + Number(width)), end = word.indexOf(0);
        values.push(String.fromCodePoint(...(end < 0 ? word : word.subarray(0, end))));
    }
    return { shape, byColumns, values };
}

/** The files of a zip archive that stores them as they are, by name. */
function readArchive(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), files = {};
    for (let at = 0; at + 30 <= bytes.length && view.getUint32(at, true) === 0x04034b50;) {
        let size = view.getUint32(at + 18, true);
        const nameLength = view.getUint16(at + 26, true), extra = at + 30 + nameLength, start = extra + view.getUint16(at + 28, true);
        if (size === 0xffffffff) size = Number(view.getBigUint64(extra + 4, true)); // sizes with 64 bits come first there
        files[new TextDecoder().decode(bytes.subarray(at + 30, extra))] = bytes.subarray(start, start + size);
        at = start + size;
    }
    return files;
}

export class Table {
    constructor(columns) {
        this.names = columns.map((column) => column.name);
        this.units = columns.map((column) => column.unit);
        this.columns = columns.map((column) => column.values);
        this.rowCount = columns.length ? columns[0].values.length : 0;
    }

    /** From the bytes of a file .npz that Kempe has written. */
    static fromNpz(bytes) {
        const files = readArchive(bytes), arrays = {};
        for (const name of Object.keys(files)) arrays[name.replace(/[.]npy$/, "")] = readArray(files[name]);
        const { names, units, values, ...words } = arrays, count = names.values.length, columns = [];
        const rows = count ? values.values.length / count : 0;
        for (let k = 0; k < count; k++) {
            const column = new Float64Array(rows);
            for (let row = 0; row < rows; row++) column[row] = values.values[values.byColumns ? k * rows + row : row * count + k];
            columns.push({ name: names.values[k], unit: units.values[k], values: column });
        }
        for (const name of Object.keys(words)) columns.push({ name, unit: "", values: words[name].values });
        return new Table(columns);
    }

    column(name) {
        const place = this.names.indexOf(name);
        if (place < 0) throw new RangeError(`the table has no column '${name}': it has ${this.names.join(", ")}`);
        return this.columns[place];
    }

    unit(name) {
        this.column(name);
        return this.units[this.names.indexOf(name)];
    }
}

/* -- messages ----------------------------------------------------------------------------------------- */

function messagesOf(lines) {
    return lines.map((line) => {
        const warning = line.startsWith("kempe: warning: ");
        const words = line.replace(/^kempe: (warning: )?/, "").replaceAll(FOLDER, "");
        const place = /^([^\t\n:]+):(\d+):(?:(\d+):)? (.*)$/s.exec(words), level = warning ? "warning" : "error";
        if (!place) return { level, text: words };
        return { level, text: place[4], file: place[1], line: Number(place[2]), ...(place[3] ? { column: Number(place[3]) } : {}) };
    });
}

const where = (message) => (message.file ? [message.file, message.line, message.column].filter((part) => part).join(":") + ": " : "");

export class KempeError extends Error {
    constructor(outcome) {
        const errors = outcome.messages.filter((message) => message.level === "error");
        const reason = outcome.summary?.reason || outcome.text || `exit code ${outcome.code}`;
        super(errors.length ? errors.map((message) => where(message) + message.text).join("\n") : reason.replaceAll(FOLDER, ""));
        this.name = "KempeError";
        this.code = outcome.code;
        this.messages = outcome.messages;
        this.outcome = outcome;
        for (const key of ["file", "line", "column"]) if (errors[0]?.[key] !== undefined) this[key] = errors[0][key];
    }
}

/* -- the worker --------------------------------------------------------------------------------------- */

/* Runs in the worker, which has its text alone: `kempeModule` is the function of the module's script. */
function serve(kempeModule, port) {
    let compiled, stopped, dragging = null, draggedFiles = "";

    const makeFolders = (files, path) => {
        for (let at = path.indexOf("/", 1); at > 0; at = path.indexOf("/", at + 1)) {
            const folder = path.slice(0, at);
            if (!files.analyzePath(folder).exists) files.mkdir(folder);
        }
    };
    const giveFiles = (files, given) => {
        for (const [path, content] of Object.entries(given)) {
            makeFolders(files, path);
            files.writeFile(path, content);
        }
    };
    const collect = (files, folder, found) => {
        for (const name of files.readdir(folder)) {
            const path = folder + name;
            if (name === "." || name === "..") continue;
            if (files.isDir(files.stat(path).mode)) collect(files, path + "/", found);
            else found[path] = files.readFile(path);
        }
    };

    const begin = (hooks) => kempeModule({
        instantiateWasm: (imports, done) => {
            WebAssembly.instantiate(compiled, imports).then(done);
            return {};
        },
        ...hooks,
    });

    /* Each command has memory of its own, so that none can leave anything to the next one. */
    const run = async ({ words, files }) => {
        const text = [], complaints = [];
        if (stopped) Atomics.store(stopped, 0, 0);
        const instance = await begin({
            print: (line) => text.push(line),
            printErr: (line) => complaints.push(line),
            kempeProgress: (done, total, unit, left) => {
                port.post({ progress: { done, total, unit, leftSeconds: left < 0 ? null : left } });
                return stopped ? Atomics.load(stopped, 0) : 0;
            },
        });
        const given = new Set(Object.keys(files)), written = {};
        giveFiles(instance.FS, files);
        makeFolders(instance.FS, "/out/");
        if (!instance.FS.analyzePath("/model").exists) instance.FS.mkdir("/model");
        instance.FS.chdir("/model");
        let code;
        try {
            code = instance.callMain(words);
        } catch (error) {
            if (typeof error?.status !== "number") throw error;
            code = error.status;
        }
        for (const folder of ["/out/", "/model/"]) collect(instance.FS, folder, written);
        for (const path of given) delete written[path];
        return { code, text: text.join("\n"), complaints, written };
    };

    /* A text in the memory of an instance, to be freed. */
    const textIn = (instance, words) => {
        const size = instance.lengthBytesUTF8(words) + 1, place = instance._malloc(size);
        instance.stringToUTF8(words, place, size);
        return place;
    };
    const beginDragging = async () => {
        const instance = await begin({ print() {}, printErr() {} }), room = instance._malloc(4);
        if (!instance._kempe_drag_new) throw new Error("it is built without dragging: WORKBENCH=ON packaging/build_wasm adds it");
        if (instance._kempe_drag_new(instance._kempe_context_new(), textIn(instance, "/model/model.yaml"), room) !== 0) throw new Error("dragging has not enough memory");
        return { instance, room, mechanisms: instance.HEAPU32[room >> 2] };
    };

    /* Dragging keeps its memory from call to call: the mechanisms that it has prepared, of the same other files. */
    const drag = async (request, files) => {
        const given = files ? Object.entries(files).map(([path, content]) => `${path} ${content.length} ${content}`).join() : draggedFiles;
        if (given !== draggedFiles) dragging = null;
        draggedFiles = given;
        if (!dragging) giveFiles((dragging = await beginDragging()).instance.FS, files ?? {});
        const { instance, room, mechanisms } = dragging, asked = textIn(instance, request);
        instance.HEAPU32[room >> 2] = 0;
        instance._kempe_drag_take(mechanisms, asked, room);
        const place = instance.HEAPU32[room >> 2], told = place ? instance.UTF8ToString(place) : null;
        instance._free(asked);
        if (place) instance._kempe_text_free(place);
        if (told === null) throw new Error("dragging has not enough memory");
        return { told, written: {} };
    };

    /* A conversation with a separate language server. */
    const talk = async (messages, files) => {
        const instance = await begin({ print() {}, printErr() {} });
        giveFiles(instance.FS, files);
        const room = instance._malloc(4), asked = textIn(instance, messages);
        if (!instance._kempe_language_server_new) throw new Error("it is built without the language server: WORKBENCH=ON packaging/build_wasm adds it");
        const wrong = instance._kempe_language_server_new(instance._kempe_context_new(), room) || instance._kempe_language_server_take(instance.HEAPU32[room >> 2], asked, instance.lengthBytesUTF8(messages), room);
        if (wrong) throw new Error("the language server does not take these messages");
        return { told: instance.UTF8ToString(instance.HEAPU32[room >> 2]), written: {} };
    };

    port.receive(async (message) => {
        try {
            if (message.compiled) {
                [compiled, stopped] = [message.compiled, message.stopped];
                port.post({ ready: true });
                return;
            }
            const answer = await (message.drag ? drag(message.drag, message.files) : message.language ? talk(message.language, message.files) : run(message));
            port.post({ answer }, Object.values(answer.written).map((bytes) => bytes.buffer));
        } catch (error) {
            port.post({ failure: String(error?.message ?? error) });
        }
    });
}

const BROWSER_PORT = "{ post: (message, moved) => postMessage(message, moved ?? []), receive: (take) => { onmessage = (event) => take(event.data); } }";
const NODE_PORT = `{ post: (message, moved) => require("node:worker_threads").parentPort.postMessage(message, moved),
    receive: (take) => require("node:worker_threads").parentPort.on("message", take) }`;
const inNode = typeof process === "object" && Boolean(process.versions?.node);

/* A worker of either system: post, terminate; `told` takes its messages, `failed` the sentence of its end. */
async function beginWorker(script, told, failed) {
    const text = (port) => `${script}\n(${serve})(kempeModule, ${port});`;
    if (inNode) {
        const { Worker: Thread } = await import("node:worker_threads");
        const worker = new Thread(text(NODE_PORT), { eval: true });
        worker.on("message", told);
        worker.on("error", (error) => failed(error.message));
        worker.unref();
        return { post: (message) => worker.postMessage(message), terminate: () => worker.terminate(), hold: () => worker.ref(), release: () => worker.unref() };
    }
    const address = URL.createObjectURL(new Blob([text(BROWSER_PORT)], { type: "text/javascript" }));
    const worker = new Worker(address);
    worker.onmessage = (event) => told(event.data);
    worker.onerror = (event) => failed(event.message);
    return { post: (message) => worker.postMessage(message), terminate: () => { worker.terminate(); URL.revokeObjectURL(address); }, hold() {}, release() {} };
}

/* -- calls -------------------------------------------------------------------------------------------- */

/** Options as words of the command: {outputStep: 0.01, set: ["a=1"], all: true} is --output-step 0.01 --set a=1 --all. */
function wordsOf(options) {
    const words = [];
    for (const [key, value] of Object.entries(options)) {
        const option = "--" + key.replace(/[A-Z]/g, (letter) => "-" + letter.toLowerCase());
        for (const one of Array.isArray(value) ? value : [value]) {
            if (one === true) words.push(option);
            else if (one !== false && one !== undefined && one !== null) words.push(option, String(one));
        }
    }
    return words;
}

const whole = (files) => Object.fromEntries(Object.entries(files).map(([name, content]) => [name.startsWith("/") ? name : FOLDER + name, content]));
const aborted = (signal) => signal.reason ?? new DOMException("the computation was cancelled", "AbortError");

/* The module, from bytes or from a response that is still being read. */
const compile = (wasm) => (wasm instanceof WebAssembly.Module ? wasm : wasm instanceof Response ? WebAssembly.compileStreaming(wasm) : WebAssembly.compile(wasm));

/* Marks of the start, which a page's tools show as user timing. */
const mark = (what) => performance.mark(`kempe: ${what}`);

export class Kempe {
    #script;
    #compiled; // a promise of the module, compiled once for all workers and commands
    #worker = null;
    #stopped = typeof SharedArrayBuffer === "function" ? new Int32Array(new SharedArrayBuffer(4)) : null;
    #current = null; // {resolve, reject, onProgress}
    #last = Promise.resolve();

    constructor(script, compiled) {
        this.#script = script;
        this.#compiled = compiled;
    }

    /** Loads the module from `parts`, or from the files beside this one, and starts its worker. */
    static async start(parts) {
        mark("start");
        const { script, wasm } = parts ?? (await loadParts());
        mark("parts");
        const compiled = Promise.resolve(compile(wasm)), kempe = new Kempe(script, compiled);
        compiled.then(() => mark("compiled"), () => {}); // an error is that of the worker's begin
        await kempe.#begin();
        mark("ready");
        return kempe;
    }

    async #begin() {
        await new Promise((resolve, reject) => {
            const told = (message) => {
                if (message.ready) {
                    this.#worker.release();
                    resolve();
                }
                if (message.progress) this.#current?.onProgress?.(message.progress);
                if (message.answer) this.#current?.resolve(message.answer);
                if (message.failure) this.#current?.reject(new Error(`Kempe's module failed: ${message.failure}`));
            };
            const failed = (sentence) => (this.#current?.reject ?? reject)(new Error(`Kempe's worker failed: ${sentence}`));
            beginWorker(this.#script, told, failed).then(async (worker) => {
                this.#worker = worker;
                worker.hold(); // until it is ready, and during each call, Node.js waits for it
                worker.post({ compiled: await this.#compiled, stopped: this.#stopped }); // it starts while the module is compiled
            }).catch((error) => {
                this.#end();
                reject(error);
            });
        });
    }

    #end() {
        this.#worker?.terminate();
        this.#worker = null;
    }

    /** Ends the worker. Later calls start a new one. */
    close() {
        this.#end();
        this.#current?.reject(new DOMException("Kempe was closed", "AbortError"));
    }

    /** Asks the present computation to end with its result so far; false: the page has no shared memory for it. */
    stop() {
        if (this.#stopped) Atomics.store(this.#stopped, 0, 1);
        return this.#stopped !== null;
    }

    /** The words of any command, as in a shell. */
    async command(words, { files = {}, onProgress, signal } = {}) {
        const answer = await this.#inTurn({ words: words.map(String), files: whole(files) }, onProgress, signal);
        const written = {}, lines = answer.complaints.join("\n").split("\n").filter((line) => line.trim());
        for (const [path, bytes] of Object.entries(answer.written)) written[path.replace(/^[/](out|model)[/]/, "")] = bytes;
        return { code: answer.code, text: answer.text, messages: messagesOf(lines), files: written };
    }

    /** Moves a mechanism by a point of a body: requests and answers of docs/workbench_protocol.md. `files`: others that the
     * model of this request names, those of the last request by default. */
    async drag(request, { files } = {}) {
        const { told } = await this.#inTurn({ drag: JSON.stringify(request), ...(files ? { files: whole(files) } : {}) }), answer = JSON.parse(told);
        if (answer.error) throw new KempeError({ code: 2, text: answer.error, messages: answer.messages ?? [] });
        return answer;
    }

    /** A whole conversation with the language server: messages of its protocol, and those of its answer. */
    async language(messages, { files = {} } = {}) {
        return (await this.#inTurn({ language: messages, files: whole(files) })).told;
    }

    /** Another worker of the same module, which computes beside this one. */
    async another() {
        const kempe = new Kempe(this.#script, this.#compiled);
        await kempe.#begin();
        return kempe;
    }

    #inTurn(message, onProgress, signal) {
        const turn = this.#last.then(() => this.#answer(message, onProgress, signal));
        this.#last = turn.catch(() => {});
        return turn;
    }

    async #answer(message, onProgress, signal) {
        if (signal?.aborted) throw aborted(signal);
        if (!this.#worker) await this.#begin();
        this.#worker.hold();
        let cancel;
        return new Promise((resolve, reject) => {
            this.#current = { resolve, reject, onProgress };
            cancel = () => {
                this.#end(); // a worker that computes reads no messages
                reject(aborted(signal));
            };
            signal?.addEventListener("abort", cancel);
            this.#worker.post(message);
        }).catch((error) => {
            this.#end();
            throw error;
        }).finally(() => {
            this.#current = null;
            signal?.removeEventListener("abort", cancel);
            this.#worker?.release();
        });
    }

    /** A study of a model: its JSON, and its table where it has one. */
    async study(command, model, options = {}, { files = {}, table = false, tableOption = "output", ...rest } = {}) {
        const name = "model.yaml", { file = name, ...others } = options;
        const given = typeof model === "string" ? { ...files, [file]: model } : { ...files, ...model };
        const path = typeof model === "string" ? file : (options.file ?? Object.keys(model)[0]);
        const words = [command, path, ...wordsOf(others), "--json", "/out/result.json", ...(table ? [`--${tableOption}`, "/out/table.npz"] : [])];
        const { files: written, ...outcome } = await this.command(words, { files: given, ...rest });
        const { "result.json": json, "table.npz": numbers, ...kept } = written;
        const summary = json ? JSON.parse(new TextDecoder().decode(json)) : null;
        const result = { ...outcome, summary, table: numbers ? Table.fromNpz(numbers) : null, files: kept };
        if (result.code !== 0 && result.code !== 5 && summary?.status !== "stopped") throw new KempeError(result);
        return result;
    }

    check(model, options, how) {
        return this.study("check", model, options, how);
    }

    assemble(model, options, how) {
        return this.study("assemble", model, options, how);
    }

    simulate(model, options, how) {
        return this.study("simulate", model, options, { table: true, ...how });
    }

    kinematics(model, options, how) {
        return this.study("kinematics", model, options, { table: true, ...how });
    }

    equilibrium(model, options, how) {
        return this.study("equilibrium", model, options, how);
    }

    modes(model, options, how) {
        return this.study("modes", model, options, { table: true, ...how });
    }

    sensitivity(model, options, how) {
        return this.study("sensitivity", model, options, { table: true, ...how });
    }

    async version() {
        return (await this.command(["--version"])).text.replace(/^kempe /, "");
    }
}

/* -- parts -------------------------------------------------------------------------------------------- */
// kempe_page.js has other lines from here on: the parts are in the script.

async function loadParts() {
    const [script, wasm] = ["kempe_module.js", "kempe_module.wasm"].map((name) => new URL(name, import.meta.url));
    if (inNode) {
        const { readFile } = await import("node:fs/promises");
        return { script: await readFile(script, "utf8"), wasm: await readFile(wasm) };
    }
    const load = async (address) => {
        const answer = await fetch(address);
        if (!answer.ok) throw new Error(`${address}: ${answer.status} ${answer.statusText}`);
        return answer;
    };
    const [text, bytes] = await Promise.all([load(script).then((answer) => answer.text()), load(wasm)]);
    return { script: text, wasm: bytes.headers.get("Content-Type") === "application/wasm" ? bytes : await bytes.arrayBuffer() };
}
