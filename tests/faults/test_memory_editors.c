/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: once */
/* A session of an editor without memory: it fails with that message, or answers. */
#include "exhaust.h"
#include <kempe/language_server.h>
#include <stdio.h>
#include <string.h>

#define URI "\"textDocument\":{\"uri\":\"untitled:a.yaml\"}"
#define TEXT                                                                                                           \
    "kempe: 1\\nparameters: {l: 1}\\nbodies:\\n  a: {joint: {revolute: z, at: ground}, mass: l, inertia: {zz: "        \
    "l^2}}\\n"
#define ASK(id, method, more)                                                                                          \
    "{\"jsonrpc\":\"2.0\",\"id\":" id ",\"method\":\"textDocument/" method "\",\"params\":{" URI more "}}"
#define AT_LENGTH ",\"position\":{\"line\":3,\"character\":49}"

static kempe_status talk(scene *s)
{
    static const char *const messages[] = {
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"initialize\",\"params\":{\"capabilities\":{}}}",
        "{\"jsonrpc\":\"2.0\",\"method\":\"textDocument/"
        "didOpen\",\"params\":{\"textDocument\":{\"uri\":\"untitled:a.yaml\","
        "\"version\":1,\"text\":\"" TEXT "\"}}}",
        ASK("2", "completion", AT_LENGTH),
        ASK("3", "hover", AT_LENGTH),
        ASK("4", "references", AT_LENGTH),
        ASK("5", "rename", AT_LENGTH ",\"newName\":\"length\""),
        ASK("6", "documentSymbol", ""),
        ASK("7", "formatting", ""),
    };
    kempe_language_server *server = NULL;
    kempe_status status = kempe_language_server_new(s->context, &server);
    untouched(status, server);
    for (size_t k = 0; status == KEMPE_OK && k < sizeof messages / sizeof *messages; k++) {
        char framed[1024], *answer = NULL;
        const int length =
            snprintf(framed, sizeof framed, "Content-Length: %zu\r\n\r\n%s", strlen(messages[k]), messages[k]);
        CHECK(length > 0 && (size_t)length < sizeof framed);
        status = kempe_language_server_take(server, framed, (size_t)length, &answer);
        untouched(status, answer);
        kempe_text_free(answer);
    }
    kempe_language_server_free(server);
    return status;
}

static const named_stage stages[] = {{"talk", talk}};

int main(void)
{
    return exhaust_alone(stages, sizeof stages / sizeof *stages, 23);
}
