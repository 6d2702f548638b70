// SPDX-License-Identifier: BSD-3-Clause
// The JavaScript interface in Node.js: node --test wasm_calls.mjs, with KEMPE_JAVASCRIPT_FOLDER the folder of kempe.mjs.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { Kempe, KempeError } = await import(pathToFileURL(join(process.env.KEMPE_JAVASCRIPT_FOLDER, "kempe.mjs")));
const kempe = await Kempe.start();

// A pendulum of length 1 m: small oscillations have the circular frequency sqrt(9.81) rad/s.
const PENDULUM = `kempe: 1
gravity: [0, 0, -9.81]
parameters: {length: 1 m}
ground: {points: {O: [0, 0, 0]}}
bodies:
  bob: {mass: 1 kg, com: [0, 0, -length], inertia: {yy: 0}, points: {O: [0, 0, 0]}}
joints:
  hinge: {revolute: [ground.O, bob.O], axis: y}
start: {q: {hinge: 0.001 rad}}
run: {t_end: 2 s, output_step: 0.1 s, outputs: [q, qd, energy]}
`;
const RATE = Math.sqrt(9.81);
const isNear = (a, b, within) => assert.ok(Math.abs(a - b) <= within, `${a} is not ${b} within ${within}`);

test("a run is a table whose columns have names and units", async () => {
    const { table, summary, code } = await kempe.simulate(PENDULUM, { rtol: 1e-10 });
    assert.equal(code, 0);
    assert.equal(summary.status, "complete");
    assert.equal(table.rowCount, 21);
    assert.equal(table.unit("q.hinge"), "rad");
    assert.ok(table.column("q.hinge") instanceof Float64Array);
    table.column("t").forEach((t, row) => isNear(table.column("q.hinge")[row], 0.001 * Math.cos(RATE * t), 1e-9));
    assert.throws(() => table.column("q.hing"), /no column 'q.hing'/);
});

test("options are those of the command", async () => {
    const { table } = await kempe.simulate(PENDULUM, { tEnd: 1, outputStep: 0.5, set: ["length=2"], allowed: null, noConvergenceCheck: true });
    assert.deepEqual([...table.column("t")], [0, 0.5, 1]);
});

test("errors have file, line and column, and the library's sentence", async () => {
    await assert.rejects(kempe.simulate(PENDULUM.replace("-length", "-lenght")), (error) => {
        assert.ok(error instanceof KempeError);
        assert.equal(error.code, 2);
        assert.deepEqual([error.file, error.line, error.column], ["model.yaml", 6, 34]);
        assert.match(error.message, /model.yaml:6:34: unknown parameter 'lenght'; did you mean 'length'[?]/);
        return true;
    });
    await assert.rejects(kempe.simulate(PENDULUM, { rtoll: 1 }), (error) => error.code === 3 && /rtoll/.test(error.message));
});

test("a model of several files", async () => {
    const files = { "top.yaml": "kempe: 1\ngravity: [0, 0, -9.81]\ninclude: [{file: parts/arm.yaml, set: {length: 4}}]\n", "parts/arm.yaml": PENDULUM };
    const { table } = await kempe.modes(files);
    isNear(table.column("frequency")[0], RATE / (4 * Math.PI), 1e-14);
    await assert.rejects(kempe.modes({ ...files, "parts/arm.yaml": PENDULUM.replace("yy: 0", "yy: [") }), { message: /parts[/]arm.yaml:6:58: YAML/ });
});

test("places in files whose names have blanks", async () => {
    const wrong = PENDULUM.replace("-length", "-lenght"), placeOf = ({ file, line, column }) => [file, line, column];
    for (const name of ["a model of mine.yaml", "my parts/arm, left (2).yaml"])
        await assert.rejects(kempe.check({ [name]: wrong }), (error) => {
            assert.deepEqual(placeOf(error), [name, 6, 34]);
            assert.equal(error.messages[0].text, "unknown parameter 'lenght'; did you mean 'length'?");
            return true;
        });
    const files = { "whole arm.yaml": "kempe: 1\ngravity: [0, 0, -9.81]\ninclude: [{file: my parts/arm 2.yaml}]\n", "my parts/arm 2.yaml": wrong };
    await assert.rejects(kempe.check(files), (error) => {
        assert.deepEqual(placeOf(error), ["my parts/arm 2.yaml", 6, 34]);
        return true;
    });
});

test("studies other than runs", async () => {
    const { table } = await kempe.modes(PENDULUM);
    isNear(table.column("frequency")[0], RATE / (2 * Math.PI), 1e-14);
    assert.equal(table.unit("frequency"), "Hz");
    const rest = await kempe.equilibrium(PENDULUM);
    assert.equal(rest.summary.status, "complete");
    const swept = await kempe.kinematics(PENDULUM, { sweep: "hinge=0 deg:90 deg:4" });
    assert.equal(swept.table.rowCount, 4);
    isNear(swept.table.column("q.hinge")[3], Math.PI / 2, 1e-15);
    const slopes = await kempe.sensitivity(PENDULUM, { parameters: "length", rtol: 1e-10 });
    slopes.table.column("t").forEach((t, row) => isNear(slopes.table.column("q.hinge/length")[row], 5e-4 * RATE * t * Math.sin(RATE * t), 1e-8));
    const start = await kempe.assemble(PENDULUM);
    assert.equal(start.summary.q.hinge, 0.001);
});

test("an abort ends the computation at once, and the next call works", async () => {
    const long = { tEnd: 1e6, outputStep: 1e5, noConvergenceCheck: true }, control = new AbortController();
    let reports = 0;
    const run = kempe.simulate(PENDULUM, long, { signal: control.signal, onProgress: (progress) => { reports++; assert.equal(progress.unit, "s"); control.abort(); } });
    await assert.rejects(run, { name: "AbortError" });
    assert.ok(reports > 0);
    await assert.rejects(kempe.simulate(PENDULUM, long, { signal: AbortSignal.abort() }), { name: "AbortError" });
    assert.equal((await kempe.check(PENDULUM)).code, 0);
});

test("a run that is asked to stop keeps its result so far", async () => {
    const { summary, table } = await kempe.simulate(PENDULUM, { tEnd: 1e6, outputStep: 10, noConvergenceCheck: true }, { onProgress: () => kempe.stop() });
    assert.equal(summary.status, "stopped");
    assert.ok(table.rowCount > 1 && table.rowCount < 1e5);
});

test("calls wait for each other; files that a command writes are given back", async () => {
    const [one, two] = await Promise.all([kempe.check(PENDULUM), kempe.simulate(PENDULUM, { plot: "curve.svg" })]);
    assert.equal(one.code, 0);
    assert.match(new TextDecoder().decode(two.files["curve.svg"]), /<svg/);
    const shown = await kempe.command(["show", "pendulum.yaml", "--model"], { files: { "pendulum.yaml": PENDULUM } });
    assert.match(shown.text, /hinge/);
});

test.after(() => kempe.close());
