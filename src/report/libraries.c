/* SPDX-License-Identifier: BSD-3-Clause */
/* three.js and Chart.js are taken from where the system has them, when a report is made. */
#include "base/file.h"
#include "base/memory.h"
#include "report/page.h"
#include <kempe/compare.h>
#include <stdlib.h>

typedef struct library {
    const char *name, *package;
    const char *files[3]; /* below a folder; NULL ends them */
} library;

static const library three = {"three.js", "libjs-three", {"three/three.min.js", "three.min.js", NULL}};
static const library chart = {"Chart.js", "libjs-chart.js", {"chart.js/chart.min.js", "chart.min.js", NULL}};

/* The variable names a folder to look in instead. */
static const char variable[] = "KEMPE_JAVASCRIPT", usual[] = "/usr/share/javascript";

static const char *folder(void)
{
    const char *own = getenv(variable);
    return own && *own ? own : usual;
}

/* The first that can be read, NULL when there is none; errors of the others are discarded. */
static kempe_status find(kempe_context *context, const library *l, char **text)
{
    *text = NULL;
    for (int k = 0; l->files[k]; k++) {
        kmp_text path = {0};
        size_t length;
        kmp_text_printf(&path, "%s/%s", folder(), l->files[k]);
        if (path.failed)
            return KEMPE_E_MEMORY;
        kempe_status status = kmp_file_read(context, path.s, text, &length);
        kmp_text_free(&path);
        if (status != KEMPE_E_IO)
            return status;
    }
    return KEMPE_OK;
}

static kempe_status read_one(kempe_context *context, const library *l, char **text)
{
    kempe_status status = find(context, l, text);
    kmp_context_clear(context);
    if (status != KEMPE_OK)
        return kmp_fail_memory(context);
    if (*text)
        return KEMPE_OK;
    return kmp_fail(context, KEMPE_E_IO,
                    "a report needs %s, but '%s' is missing in %s: install the Debian package %s, or give its folder "
                    "in the environment variable %s",
                    l->name, l->files[0], folder(), l->package, variable);
}

kempe_status kmp_page_libraries_read(kempe_context *context, kmp_page_libraries *libraries)
{
    *libraries = (kmp_page_libraries){0};
    kempe_status status = read_one(context, &three, &libraries->three);
    if (status == KEMPE_OK)
        status = read_one(context, &chart, &libraries->chart);
    if (status != KEMPE_OK)
        kmp_page_libraries_free(libraries);
    return status;
}

void kmp_page_libraries_free(kmp_page_libraries *libraries)
{
    kmp_free(libraries->three);
    kmp_free(libraries->chart);
    *libraries = (kmp_page_libraries){0};
}

kempe_status kempe_report_check(kempe_context *context)
{
    KMP_WANTED(NULL, context, "context");
    kmp_page_libraries libraries;
    kmp_context_clear(context);
    kempe_status status = kmp_page_libraries_read(context, &libraries);
    if (status == KEMPE_OK)
        kmp_page_libraries_free(&libraries);
    return status;
}
