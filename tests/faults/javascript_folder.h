/* SPDX-License-Identifier: BSD-3-Clause */
/* A folder with libraries for report pages of a line each. */
#ifndef KEMPE_TESTS_JAVASCRIPT_FOLDER_H
#define KEMPE_TESTS_JAVASCRIPT_FOLDER_H

#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static inline bool make_libraries(kempe_context *context)
{
    static char folder[] = "/tmp/kempe_memory_js_XXXXXX";
    static const char *const names[] = {"three.min.js", "chart.min.js"};
    char file[64];
    bool ok = mkdtemp(folder) && setenv("KEMPE_JAVASCRIPT", folder, 1) == 0;
    for (int k = 0; k < 2 && ok; k++) {
        snprintf(file, sizeof file, "%s/%s", folder, names[k]);
        ok = kempe_write_file(context, file, "/* </script> */\n") == KEMPE_OK;
    }
    return ok;
}

static inline void remove_libraries(void)
{
    static const char *const names[] = {"/three.min.js", "/chart.min.js", ""};
    char file[64];
    for (int k = 0; k < 3; k++) {
        snprintf(file, sizeof file, "%s%s", getenv("KEMPE_JAVASCRIPT"), names[k]);
        (void)remove(file);
    }
}

#endif
