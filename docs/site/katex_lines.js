// SPDX-License-Identifier: BSD-3-Clause
// Equations as HTML with MathML: node katex_lines.js katex.js reads {source, display} a line and answers {html} or {error}.
const katex = require(process.argv[2]);
require("readline").createInterface({ input: process.stdin }).on("line", (line) => {
  const { source, display } = JSON.parse(line);
  try {
    console.log(JSON.stringify({ html: katex.renderToString(source, { displayMode: display, throwOnError: true }) }));
  } catch (error) {
    console.log(JSON.stringify({ error: String(error) }));
  }
});
