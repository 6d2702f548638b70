/* SPDX-License-Identifier: BSD-3-Clause */
/* `kempe language-server`: messages of an editor on standard input, answers on standard output. */
#include "platform/platform.h"
#include "study.h"

#include <kempe/language_server.h>
#include <string.h>

static bool write_all(const char *text)
{
    const size_t length = strlen(text);
    return (length == 0 || fwrite(text, 1, length, stdout) == length) && fflush(stdout) == 0;
}

kempe_status cli_language_server(const cli_job *j)
{
    static char bytes[1 << 16];
    kempe_language_server *server = NULL;
    kempe_status status = kempe_language_server_new(j->context, &server);
    while (status == KEMPE_OK && kempe_language_server_is_running(server)) {
        char *answer = NULL;
        const ptrdiff_t count = kmp_file_get(0, bytes, sizeof bytes);
        if (count <= 0)
            break; /* the editor is gone */
        status = kempe_language_server_take(server, bytes, (size_t)count, &answer);
        if (answer && !write_all(answer))
            status = KEMPE_E_FAILED;
        kempe_text_free(answer);
    }
    cli_report_failure(j, status, false);
    if (status == KEMPE_OK && !kempe_language_server_is_finished(server))
        status = KEMPE_E_FAILED;
    if (server)
        kempe_language_server_free(server);
    return status;
}
