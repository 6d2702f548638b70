// SPDX-License-Identifier: BSD-3-Clause
// kempe_page.js: the interface, the module and its bytes as one script, for pages that are opened as files, where neither modules nor
// requests work. Used by packaging/build_wasm: node join_page.mjs KEMPE.MJS MODULE.JS MODULE.WASM[.GZ] OUTPUT
import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const [, , interfaceFile, scriptFile, wasmFile, output] = process.argv;
const [shared] = readFileSync(interfaceFile, "utf8").split("/* -- parts ---");
const packed = (wasmFile.endsWith(".gz") ? readFileSync(wasmFile) : gzipSync(readFileSync(wasmFile), { level: 9 })).toString("base64");
const script = JSON.stringify(readFileSync(scriptFile, "utf8")).replaceAll("</", "<\\/");

writeFileSync(output, `// SPDX-License-Identifier: BSD-3-Clause
globalThis.Kempe = (() => {
${shared.replace(/^export /gm, "").replaceAll("</", "<\\/")}
async function loadParts() {
    const letters = atob("${packed}"), packed = new Uint8Array(letters.length);
    for (let k = 0; k < packed.length; k++) packed[k] = letters.charCodeAt(k); // Uint8Array.from takes thirty times as long
    const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return { script: ${script}, wasm: new Response(unpacked, { headers: { "Content-Type": "application/wasm" } }) };
}
return Object.assign(Kempe, { Table, KempeError });
})();
`);
