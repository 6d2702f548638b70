// SPDX-License-Identifier: BSD-3-Clause
// Starts `kempe language-server` for YAML files. The server ignores files that are not models of Kempe.
"use strict";
const vscode = require("vscode");
const { LanguageClient, TransportKind } = require("vscode-languageclient/node");

let client;

exports.activate = async function () {
  const command = vscode.workspace.getConfiguration("kempe").get("command", "kempe");
  client = new LanguageClient(
    "kempe",
    "Kempe models",
    { command, args: ["language-server"], transport: TransportKind.stdio },
    { documentSelector: [{ language: "yaml" }] }
  );
  await client.start();
};

exports.deactivate = function () {
  return client && client.stop();
};
