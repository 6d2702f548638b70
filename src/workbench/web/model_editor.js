/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of the model in CodeMirror: completion, explanations, marks of errors, changes by the mouse as single steps of undo. */
"use strict";

const HOVER_WAIT = 350; /* ms */
let modelEditor = null;

/* -- help --------------------------------------------------------------------------------------------------- */

/* A list of completions for the editor. */
async function editorHints(editor) {
    const cursor = editor.getCursor(), found = await completionsAt(editor.getValue(), cursor).catch(() => null);
    if (!found || found.list.length === 0) return null;
    const render = (node, _, { text, about }) => {
        const words = element("small", about);
        node.append(text, words);
    };
    return { from: found.from, to: cursor, list: found.list.map((one) => ({ ...one, render })) };
}

/* The explanation of what the pointer rests on. */
function listenToHover(editor) {
    const box = element("div"), host = editor.getWrapperElement();
    let timer = 0;
    box.id = "explained";
    box.setAttribute("role", "tooltip");
    box.hidden = true;
    document.body.append(box);
    const hide = () => {
        clearTimeout(timer);
        timer = 0;
        box.hidden = true;
    };
    host.addEventListener("mousemove", (event) => {
        hide();
        const asked = setTimeout(async () => {
            const place = editor.coordsChar({ left: event.clientX, top: event.clientY }, "window"), words = place.outside ? "" : await explanationAt(editor.getValue(), place).catch(() => "");
            if (!words || timer !== asked || !event.target.closest(".CodeMirror-lines") || document.querySelector(".CodeMirror-lint-tooltip")) return;
            box.textContent = words;
            box.hidden = false;
            box.style.left = `${Math.max(4, Math.min(event.clientX, innerWidth - box.offsetWidth - 8))}px`;
            box.style.top = `${event.clientY + 18 + box.offsetHeight > innerHeight ? event.clientY - box.offsetHeight - 10 : event.clientY + 18}px`;
        }, HOVER_WAIT);
        timer = asked;
    });
    for (const kind of ["mouseleave", "mousedown", "keydown", "wheel"]) host.addEventListener(kind, hide, { passive: true });
}

/* The explanation at the cursor, for the keyboard. */
async function explainAtCursor(editor) {
    const words = await explanationAt(editor.getValue(), editor.getCursor()).catch((error) => sentence(error.message));
    writeMessages(words ? [{ level: "remark", text: words }] : []);
}

/* Asks for another name of what is at the cursor, and writes it wherever the name is. */
async function renameAtCursor(editor) {
    const text = editor.getValue(), place = editor.getCursor();
    try {
        const reply = await askLanguage("textDocument/prepareRename", text, place);
        if (!reply) throw new Error("There is no name at the cursor that the model declares.");
        const range = reply.range ?? reply, own = editor.getRange(placeOfText(range.start), placeOfText(range.end)), box = element("label", "New name: ", element("input"));
        box.querySelector("input").setAttribute("aria-label", `New name of ${own}`);
        editor.openDialog(box, async (name) => {
            try {
                if (editor.getValue() === text) changeText(await renamedText(text, place, name));
            } catch (error) {
                writeMessages([{ level: "error", text: sentence(error.message) }]);
            }
        }, { value: own, selectValueOnOpen: true });
    } catch (error) {
        writeMessages([{ level: "remark", text: sentence(error.message) }]);
    }
}

/* -- errors ------------------------------------------------------------------------------------------------- */

/* A message as a mark: from its column to the end of the word there. */
function markOf(editor, { level, text, line, column = 1 }) {
    const at = Math.min(line - 1, editor.lastLine()), words = editor.getLine(at), from = Math.min(column - 1, Math.max(words.length - 1, 0));
    const to = from + Math.max(/^[\w.]*/.exec(words.slice(from))[0].length, 1);
    return { from: { line: at, ch: from }, to: { line: at, ch: to }, message: text, severity: level === "warning" ? "warning" : "error" };
}

/* Marks at their lines, and a list below the text; a press goes there. */
function writeErrors(messages) {
    const shown = bench.shown ?? bench.name, own = messages.filter(({ line, file = bench.name }) => line && file === shown);
    bench.messages = messages;
    modelEditor.operation(() => {
        modelEditor.state.kempeMarks = own.map((message) => markOf(modelEditor, message));
        modelEditor.performLint();
    });
    writeMessages(messages);
}

function writeMessages(messages) {
    byId("messages").replaceChildren(...messages.slice(0, 30).map((message) => {
        const { file = bench.name } = message, elsewhere = file === bench.name ? "" : `${file}, `, held = !elsewhere || bench.others.has(file);
        const place = message.line ? `${elsewhere}line ${message.line}${message.column ? `:${message.column}` : ""}: ` : "", press = element(`button.${message.level}`, place + message.text + withoutFile(message));
        press.type = "button";
        press.addEventListener("click", () => message.line && held && goToLine(message.line, message.column, file));
        return press;
    }));
}

function goToLine(line, column = 1, file = bench.name) {
    showPanel("text");
    showFile(file === bench.name ? null : file);
    modelEditor.setCursor({ line: line - 1, ch: column - 1 });
    modelEditor.focus();
}

/* -- the text ----------------------------------------------------------------------------------------------- */

/* Puts another text in place of the present one as one step of undo, and shows what was changed. */
function changeText(after) {
    showFile(null);
    const before = modelEditor.getValue();
    if (before === after) return;
    const { from, to, words } = differenceOf(before, after);
    modelEditor.operation(() => {
        modelEditor.changeGeneration(true);
        modelEditor.replaceRange(words, modelEditor.posFromIndex(from), modelEditor.posFromIndex(to), "drawn");
        const [first, last] = [from, from + words.length].map((at) => modelEditor.posFromIndex(at)), mark = modelEditor.markText(first, last, { className: "drawn-now" });
        modelEditor.scrollIntoView({ from: { line: first.line, ch: 0 }, to: { line: last.line, ch: 0 } }, 40);
        setTimeout(() => mark.clear(), 2500);
    });
}

function writeUndo() {
    const { undo, redo } = modelEditor.historySize();
    byId("undo").disabled = undo === 0;
    byId("redo").disabled = redo === 0;
}

/* Tab indents in the text: Escape goes on to the buttons. */
function leaveEditor() {
    if (document.querySelector(".CodeMirror-hints")) return CodeMirror.Pass;
    byId("undo").focus();
    return null;
}

/* `changed()` is called after each change of the text. */
function beginEditor(changed) {
    modelEditor = CodeMirror(byId("editor"), {
        mode: "yaml", lineNumbers: true, indentUnit: 2, tabSize: 2, gutters: ["CodeMirror-lint-markers"], viewportMargin: 40,
        lint: { lintOnChange: false, getAnnotations: () => modelEditor?.state.kempeMarks || [] },
        hintOptions: { hint: editorHints, completeSingle: false },
        extraKeys: {
            "Ctrl-Space": "autocomplete", "Ctrl-/": "toggleComment", "Cmd-/": "toggleComment", F1: explainAtCursor, F2: renameAtCursor,
            Tab: (editor) => (editor.somethingSelected() ? editor.indentSelection("add") : editor.replaceSelection("  ", "end")), "Shift-Tab": "indentLess",
        },
    });
    modelEditor.getInputField().setAttribute("aria-label", "Text of the model. Ctrl+Space completes, F1 explains, F2 renames, Escape then Tab leaves.");
    modelEditor.addKeyMap({ Esc: leaveEditor });
    modelEditor.on("change", changed);
    modelEditor.on("inputRead", (editor, { text }) => /[\w.]$/.test(text[0]) && text.length === 1 && editor.showHint());
    listenToHover(modelEditor);
}
