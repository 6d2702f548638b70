/* SPDX-License-Identifier: BSD-3-Clause */
/* Below the picture: the direction of view, a larger picture, the whole screen, and a video of one pass. */
"use strict";

/* Directions of view: how far it is turned about the upward axis, and down. */
const VIEWS = { Front: [0, 0], Side: [Math.PI / 2, 0], Top: [0, Math.PI / 2], Oblique: [0.6, 0.4] };
const FRAMES_EACH_SECOND = 30, VIDEO_TYPES = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];

const videoType = () => (window.MediaRecorder && HTMLCanvasElement.prototype.captureStream ? VIDEO_TYPES.find((type) => MediaRecorder.isTypeSupported(type)) : undefined);

/* An image of what is drawn over the picture. */
async function imageOf(drawing, width, height) {
    const copy = drawing.cloneNode(true), image = new Image(), ink = getComputedStyle(document.body);
    for (const [name, value] of Object.entries({ width, height, "font-family": ink.fontFamily })) copy.setAttribute(name, value);
    image.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
    await image.decode();
    return image;
}

/* The picture with what is over it, on the colour of its card. */
async function paintFrame(sheet, canvas, drawing) {
    const c = sheet.getContext("2d"), over = await imageOf(drawing, sheet.width, sheet.height);
    c.fillStyle = getComputedStyle(byId("stage")).backgroundColor;
    c.fillRect(0, 0, sheet.width, sheet.height);
    c.drawImage(canvas, 0, 0, sheet.width, sheet.height);
    c.drawImage(over, 0, 0, sheet.width, sheet.height);
}

/* Offers a file for download. */
function giveFile(blob, name) {
    const link = element("a"), address = URL.createObjectURL(blob);
    link.href = address;
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/* Records one pass in the time that it takes to play; `stage.stopped()` ends it before. The recorded blob. */
async function recordPass(canvas, drawing, stage, type) {
    const sheet = element("canvas"), parts = [];
    sheet.width = 2 * Math.floor(canvas.width / 2); /* encoders want even numbers */
    sheet.height = 2 * Math.floor(canvas.height / 2);
    sheet.getContext("2d");
    const stream = sheet.captureStream(0), recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 8e6 });
    const ended = new Promise((resolve) => (recorder.onstop = resolve)), begun = performance.now(), frames = Math.round(stage.seconds() * FRAMES_EACH_SECOND);
    recorder.ondataavailable = (event) => parts.push(event.data);
    recorder.start();
    for (let k = 0; k <= frames && !stage.stopped(); k++) {
        stage.show((stage.length() * k) / frames);
        await paintFrame(sheet, canvas, drawing);
        stream.getVideoTracks()[0].requestFrame();
        const rest = begun + (1000 * (k + 1)) / FRAMES_EACH_SECOND - performance.now();
        await new Promise((resolve) => setTimeout(resolve, Math.max(rest, 0)));
    }
    recorder.stop();
    await ended;
    return new Blob(parts, { type });
}

/* A button without a state. */
function actionOf(words, title, press) {
    const made = buttonOf(words, false, press);
    made.removeAttribute("aria-pressed");
    made.title = title;
    return made;
}

/* The button of the video: it records, and a second click ends the recording with what it has. */
function videoButton(canvas, drawing, stage) {
    const type = videoType(), button = actionOf("Video", "Records one pass as a file; a second click ends it", async () => {
        const records = button.textContent !== "Video";
        button.textContent = records ? "Video" : "End video";
        if (records) return;
        const blob = await recordPass(canvas, drawing, { ...stage, stopped: () => button.textContent === "Video" }, type);
        button.textContent = "Video";
        giveFile(blob, `${document.title.split(/[^\w-]/)[0] || "motion"}.${type.startsWith("video/mp4") ? "mp4" : "webm"}`);
    });
    button.hidden = !type || !(stage.length() > 0);
    return button;
}

/* `stage`: its orbit, draw(), seconds() and length() of a pass, and show(time), which does not go on. */
function beginViews(canvas, drawing, stage) {
    const figure = byId("stage"), choice = element("select"), { home } = stage.orbit;
    choice.setAttribute("aria-label", "Direction of view");
    choice.append(optionOf("View", ""), ...Object.keys(VIEWS).map((name) => optionOf(name, name)));
    choice.addEventListener("change", () => {
        const [yaw, pitch] = VIEWS[choice.value] || [home.yaw, home.pitch];
        Object.assign(stage.orbit, { yaw, pitch });
        stage.draw();
    });
    const larger = buttonOf("Larger", false, () => larger.setAttribute("aria-pressed", String(figure.classList.toggle("larger"))));
    const whole = actionOf("Full screen", "The picture on the whole screen; Escape leaves it", () => (document.fullscreenElement ? document.exitFullscreen() : figure.requestFullscreen()));
    whole.hidden = !document.fullscreenEnabled;
    document.addEventListener("fullscreenchange", () => (whole.textContent = document.fullscreenElement ? "Leave full screen" : "Full screen"));
    byId("views").append(choice, larger, whole, videoButton(canvas, drawing, stage));
}
