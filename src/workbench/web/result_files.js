/* SPDX-License-Identifier: BSD-3-Clause */
/* Downloads: tables, curves, pictures, videos, the moving mechanism for other programs, and links that contain a model. */
"use strict";

const VIDEO_SECONDS = 12; /* the longest video */

function saveFile(name, content, type) {
    giveFile(content instanceof Blob ? content : new Blob([content], { type }), name);
    document.documentElement.dataset.downloaded = name;
}

const stemOf = () => bench.name.replace(/\.[^.]*$/, "");

/* A file that the command of the result writes in addition: curves as SVG, the motion as glTF. */
async function fromCommand(options, file) {
    const { answer, files } = resultNow(), keep = answer.asked.filter((word, k, all) => !["--report", "--output", "--json"].includes(word) && !["--report", "--output", "--json"].includes(all[k - 1]));
    const reply = await bench.engine.command([...keep, ...options], { files, run: "file" });
    if (!reply.files[file]) throw new Error(failed(reply));
    return reply.files[file];
}

/* The picture with what is drawn over it. */
async function wholePicture() {
    const canvas = byId("view"), sheet = element("canvas");
    Object.assign(sheet, { width: canvas.width, height: canvas.height });
    await paintFrame(sheet, canvas, byId("gauge"));
    return sheet;
}

const pngOf = (canvas) => new Promise((done) => canvas.toBlob(done, "image/png"));

/* One pass of the motion, recorded by the browser while it plays: [the video, the ending of its name]. */
async function recordVideo() {
    const [from, to] = timeSpan(), type = videoType(), seconds = Math.min(Math.max(to - from, 1), VIDEO_SECONDS);
    if (!type) throw new Error("this browser cannot record a canvas");
    writeHint(`Recording ${three(seconds)} s of video.`);
    play(false);
    const video = await recordPass(byId("view"), byId("gauge"), { seconds: () => seconds, length: () => to - from, show: (t) => showTime(from + t), stopped: () => false }, type);
    writeHint();
    return [video, type.startsWith("video/mp4") ? "mp4" : "webm"];
}

const hasResult = () => Boolean(resultNow()?.answer?.page);
const isRun = () => hasResult() && ["simulate", "kinematics"].includes(resultNow().answer.asked[0]);

/* `ready` says whether there is a file, `make` saves it. */
const DOWNLOADS = {
    yaml: { ready: () => true, make: () => saveFile(bench.name, bench.text, "text/yaml") },
    csv: { ready: () => hasResult() && Boolean(resultNow().answer.csv), make: () => saveFile(`${stemOf()}.csv`, resultNow().answer.csv, "text/csv") },
    svg: { ready: isRun, make: async () => saveFile(`${stemOf()}.svg`, await fromCommand(["--plot", "/out/curves.svg", ...curvesAsked()], "curves.svg"), "image/svg+xml") },
    "curves-png": { ready: () => !byId("plot-figure").hidden, make: async () => saveFile(`${stemOf()}_curves.png`, await pngOf(byId("plot"))) },
    png: { ready: () => Boolean(shownScene.m), make: async () => saveFile(`${stemOf()}.png`, await pngOf(await wholePicture())) },
    video: {
        ready: () => timeSpan()[1] > timeSpan()[0],
        async make() {
            const [video, ending] = await recordVideo();
            saveFile(`${stemOf()}.${ending}`, video);
        },
    },
    glb: { ready: () => hasResult() && resultNow().answer.asked[0] === "simulate", make: async () => saveFile(`${stemOf()}.glb`, await fromCommand(["--animation", "/out/motion.glb"], "motion.glb"), "model/gltf-binary") },
    html: { ready: hasResult, make: () => saveFile(`${stemOf()}_${resultNow().answer.asked[0]}.html`, resultNow().answer.html, "text/html") },
};

/* The curves of the picture as outputs of the command: "position(bar2.C)"; all of them where it has no such word. */
function curvesAsked() {
    const [kind, ...rest] = studies.group.split("|")[0].split(".");
    if (studies.shown !== "motion") return [];
    if (kind in GROUP_WORDS) return ["--y", kind];
    return ["position", "velocity", "acceleration", "reaction"].includes(kind) ? ["--y", `${kind}(${rest.join(".")})`] : [];
}

/* -- links -------------------------------------------------------------------------------------------------- */

const LINK = "#model=", LINK_OF_FILES = "#files=";

async function throughStream(bytes, stream) {
    return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

/* The text, compressed, in letters that an address may have. */
async function packed(text) {
    const bytes = await throughStream(new TextEncoder().encode(text), new CompressionStream("deflate-raw"));
    return lettersOf(bytes).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

/* Bytes in base64; a call takes only so many arguments. */
function lettersOf(bytes) {
    const parts = [];
    for (let k = 0; k < bytes.length; k += 8192) parts.push(String.fromCharCode(...bytes.subarray(k, k + 8192)));
    return btoa(parts.join(""));
}

/* The link of the model, with its other files where it has any. */
async function linkOfModel() {
    if (bench.others.size === 0) return LINK + (await packed(bench.text));
    const others = Object.fromEntries([...bench.others].map(([name, { text, bytes }]) => [name, text === undefined ? { base64: lettersOf(bytes) } : { text }]));
    return LINK_OF_FILES + (await packed(JSON.stringify({ name: bench.name, text: bench.text, others })));
}

/* { text, name, others } of a link, others by their names; null: it has no model. */
async function modelOfLink(link) {
    const begin = [LINK, LINK_OF_FILES].find((word) => link.startsWith(word));
    if (!begin) return null;
    const bytes = new Uint8Array(bytesOf(link.slice(begin.length).replaceAll("-", "+").replaceAll("_", "/")));
    const text = new TextDecoder().decode(await throughStream(bytes, new DecompressionStream("deflate-raw")));
    if (begin === LINK) return { text };
    const reply = JSON.parse(text), fileOf = ({ text: own, base64 }) => (typeof own === "string" ? { text: own } : { bytes: new Uint8Array(bytesOf(base64)) });
    if (typeof reply.text !== "string") throw new Error("no model");
    return { text: reply.text, name: String(reply.name), others: Object.fromEntries(Object.entries(reply.others).map(([name, file]) => [name, fileOf(file)])) };
}

/* The address of a page that others can open, with the model; of a server for one user only the part with the model, since the address
 * has the token of the server. */
async function shareModel() {
    const part = await linkOfModel(), address = bench.engine.isPrivate ? part : location.href.split("#")[0] + part;
    document.documentElement.dataset.shared = address;
    try {
        await navigator.clipboard.writeText(address);
        writeHint(bench.engine.isPrivate ? "Copied. At the end of the address of any workbench it opens this model." : "The link is copied: it opens this model.");
    } catch {
        writeNotice("The browser does not let this page copy. The link: ", []);
        byId("notice").append(element("code", address));
    }
}

/* -- the menu ----------------------------------------------------------------------------------------------- */

async function takeAway(key) {
    byId("more").open = false;
    try {
        await DOWNLOADS[key].make();
    } catch (error) {
        writeHint(sentence(error.message));
    }
}

function beginFiles(take) {
    for (const button of document.querySelectorAll("[data-download]")) button.addEventListener("click", () => takeAway(button.dataset.download));
    byId("more").addEventListener("toggle", () => {
        for (const button of document.querySelectorAll("[data-download]")) button.disabled = !DOWNLOADS[button.dataset.download].ready();
    });
    document.addEventListener("pointerdown", (event) => !byId("more").contains(event.target) && (byId("more").open = false));
    byId("more").addEventListener("keydown", (event) => {
        if (event.key !== "Escape") return;
        byId("more").open = false;
        byId("more").querySelector("summary").focus();
    });
    byId("share").addEventListener("click", () => {
        byId("more").open = false;
        shareModel();
    });
    byId("open-file").addEventListener("click", () => byId("file-input").click());
    byId("file-input").addEventListener("change", async () => {
        byId("more").open = false;
        await take([...byId("file-input").files]);
        byId("file-input").value = "";
    });
    for (const kind of ["dragover", "drop"]) document.addEventListener(kind, (event) => event.dataTransfer?.types.includes("Files") && event.preventDefault());
    document.addEventListener("drop", (event) => take([...(event.dataTransfer?.files || [])]));
}
