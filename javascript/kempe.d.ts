// SPDX-License-Identifier: BSD-3-Clause
/** Kempe in browsers and Node.js. docs/javascript.md explains its use. */

/** Contents of files by their names, relative to the model's folder. */
export type Files = Record<string, string | Uint8Array>;

/** The text of a model in YAML; or a model of several files, of which the first one is read and includes the others. */
export type Model = string | Files;

/** Options of the command in camel case: {rtol: 1e-9, outputStep: 0.01, set: ["length=0.3"], all: true}. `kempe help
 * COMMAND` and docs/command.md list them. An array repeats an option; false, null and undefined leave it out. `file` is
 * the name under which the text of a model is read, model.yaml; its ending chooses the format. */
export type Options = Record<string, string | number | boolean | null | undefined | (string | number)[]> & { file?: string };

/** `done` of `total`: simulated seconds of a run ("s"), otherwise a plural: "rows", "values", "starts", .. */
export interface Progress {
    done: number;
    total: number;
    unit: string;
    /** Seconds at the pace so far; null while there is no estimate. */
    leftSeconds: number | null;
}

/** How a command is run. */
export interface How {
    /** Files beside the model: what it includes, samples of curves, references. */
    files?: Files;
    /** Called some ten times a second during long computations. */
    onProgress?: (progress: Progress) => void;
    /** Its abort ends the worker: the promise is rejected with the signal's reason, and the next call starts a new
     * worker. `Kempe.stop` keeps the result so far instead. */
    signal?: AbortSignal;
}

/** How a study is run, with what it writes. */
export interface StudyHow extends How {
    /** Whether the study writes a table by `tableOption` ("output"). */
    table?: boolean;
    tableOption?: string;
}

/** A sentence of the library. Errors of a model have the file, the line and the column that it is about, from 1. */
export interface Message {
    level: "error" | "warning";
    text: string;
    file?: string;
    line?: number;
    column?: number;
}

/** What a command left. */
export interface Outcome {
    /** 0 complete, 1 failed or stopped early, 2 error in the input, 3 wrong usage, 4 internal error of Kempe,
     * 5 complete but not trustworthy: its warnings say why. */
    code: number;
    /** As a terminal would show it. */
    text: string;
    messages: Message[];
    /** The files that it wrote, by their names. */
    files: Record<string, Uint8Array>;
}

/** The result of a study. */
export interface Result extends Outcome {
    /** The object of `--json`, in SI units. */
    summary: any;
    /** Its table; null of a study without one. */
    table: Table | null;
}

/** A table: columns of numbers or words, all equally long. */
export class Table {
    /** As in CSV files: "t", "q.crank", "position.coupler.P.x". */
    readonly names: string[];
    /** "" of pure numbers and of words. */
    readonly units: string[];
    readonly columns: (Float64Array | string[])[];
    readonly rowCount: number;
    constructor(columns: { name: string; unit: string; values: Float64Array | string[] }[]);
    /** From the bytes of a file .npz that Kempe has written. */
    static fromNpz(bytes: Uint8Array): Table;
    /** A column by its name. RangeError: there is none. */
    column(name: string): Float64Array | string[];
    unit(name: string): string;
}

/** A command failed. `message` has all errors, a line each, and what follows is of the first one. */
export class KempeError extends Error {
    readonly code: number;
    readonly messages: Message[];
    readonly file?: string;
    readonly line?: number;
    readonly column?: number;
    /** The result so far of a run that failed; its summary and table may be null. */
    readonly outcome: Result;
}

/** The parts of the module, where they are not the files beside kempe.mjs. */
export interface Parts {
    /** The text of kempe_module.js. */
    script: string;
    /** kempe_module.wasm, or a response with it of type application/wasm, which is compiled while it is read. */
    wasm: BufferSource | WebAssembly.Module | Response;
}

/** A worker that runs commands, one after another. Each has memory of its own. */
export class Kempe {
    /** Loads the module and starts its worker. It marks its steps for `performance.getEntriesByType("mark")`: "kempe: start",
     * "kempe: parts", "kempe: compiled", "kempe: ready". */
    static start(parts?: Parts): Promise<Kempe>;

    /** "0.2.0" */
    version(): Promise<string>;

    /** Mobility, redundancy and the assembled state; the summary has the result. */
    check(model: Model, options?: Options, how?: StudyHow): Promise<Result>;
    /** Coordinates that close the loops; the summary has the result. */
    assemble(model: Model, options?: Options, how?: StudyHow): Promise<Result>;
    /** A run: `table` has a row for each output time. */
    simulate(model: Model, options?: Options, how?: StudyHow): Promise<Result>;
    /** Positions, velocities and accelerations over a range: `table` has a row for each value. */
    kinematics(model: Model, options?: Options, how?: StudyHow): Promise<Result>;
    /** Static or steady equilibrium; the summary has the result. */
    equilibrium(model: Model, options?: Options, how?: StudyHow): Promise<Result>;
    /** Eigenvalues and mode shapes: `table` has a row for each mode. */
    modes(model: Model, options?: Options, how?: StudyHow): Promise<Result>;
    /** Derivatives by parameters: `table` has a row for each. */
    sensitivity(model: Model, options?: Options, how?: StudyHow): Promise<Result>;

    /** Any command with a model that has --json. Rejected with KempeError on errors; complete results that are not
     * trustworthy (5) and those that were stopped are given back. */
    study(command: string, model: Model, options?: Options, how?: StudyHow): Promise<Result>;

    /** The words of any command, as in a shell: ["show", "model.yaml"]. Names are relative to the folder of `files`.
     * Never rejected for what the command says: see `code`. */
    command(words: (string | number)[], how?: How): Promise<Outcome>;

    /** Moves a mechanism by a point of a body: requests and answers as for `drag` in docs/workbench_protocol.md, in SI. The
     * module needs the wing WORKBENCH. `files`: other files that the model names, by default those of the last request. Rejected with KempeError where the model has an error or its
     * loops do not close. */
    drag(request: object, how?: { files?: Files }): Promise<any>;

    /** A whole conversation with a separate language server: messages of the Language Server Protocol, headers included,
     * and those of its answers. `files`: others that the model names. The module needs the wings WORKBENCH and LANGUAGE_SERVER. */
    language(messages: string, how?: { files?: Files }): Promise<string>;

    /** Another worker of the same module, which computes beside this one. */
    another(): Promise<Kempe>;

    /** Asks the present computation to end with its result so far, `summary.status` "stopped". false: this page has no
     * SharedArrayBuffer, which needs the headers of cross-origin isolation; Node.js always has it. */
    stop(): boolean;

    /** Ends the worker and rejects the present call. Later calls start a new one. */
    close(): void;
}
