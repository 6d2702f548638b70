/* SPDX-License-Identifier: BSD-3-Clause */
/* Output of `assemble --branches`: each assembly mode, and the start values that select it. */
#include "constraints/closing/assembly_modes.h"
#include "model/data/model.h"
#include "output/print.h"
#include <kempe/check.h>

static void list_kept(kmp_text *text, const kempe_branches *b)
{
    int listed = 0;
    for (int k = 0; k < b->system->n; k++)
        if (b->kept[k])
            kmp_text_printf(text, "%s%s", listed++ ? ", " : "", b->system->model->motions[k].name);
    kmp_text_put(text, listed ? "" : "nothing");
}

/* The lines to write into the model, numbers in rad and m, nine digits: enough to assemble there. */
static void show_start(kmp_text *text, const kempe_branches *b, const kmp_branch *branch)
{
    kmp_text_put(text, "  start: {q: {");
    for (int k = 0; k < b->system->n; k++)
        kmp_text_printf(text, "%s%s: %.9g", k ? ", " : "", b->system->model->motions[k].name, branch->q[k]);
    bool held = false;
    for (int k = 0; k < b->system->n; k++)
        held = held || b->kept[k];
    kmp_text_put(text, held ? "}, hold: [" : "}");
    if (held) {
        list_kept(text, b);
        kmp_text_put(text, "]");
    }
    kmp_text_put(text, "}\n");
}

static void show_branches(kmp_text *text, const void *result)
{
    const kempe_branches *b = result;
    kmp_print_title(text, b->system->model, kmp_status_word(b->status));
    kmp_text_printf(text, "%s%d assembly mode%s found, holding ", b->many ? "more than " : "", b->count,
                    b->count == 1 ? "" : "s");
    list_kept(text, b);
    kmp_text_printf(text, "\n%d random starts, %d of them assembled; sampling may miss some modes\n", b->starts,
                    b->closed);
    for (int k = 0; k < b->count; k++) {
        const kmp_branch *branch = &b->branch[k];
        int width = kmp_print_width(b->system, KMP_QUANTITY_Q);
        kmp_text_printf(text, "\nbranch %d%s", k + 1, k ? "" : " (of the model)");
        if (branch->sign[0])
            kmp_text_printf(text, "  sign %s", branch->sign);
        kmp_text_printf(text, "  |h| %.2e\n", branch->residual);
        for (int c = 0; c < b->system->n; c++)
            kmp_text_printf(text, "  %-*s  %-4s  %22.15g%s\n", width, b->system->model->motions[c].name,
                            kmp_print_unit(b->system, c), kmp_print_value(b->system, c, branch->q[c]),
                            b->kept[c] ? "  kept" : "");
        show_start(text, b, branch);
    }
    if (b->many)
        kmp_text_put(text,
                     "\nnote  such a large number suggests that the held coordinates leave a degree of freedom\n");
}

static void json_branches(kmp_text *text, const void *result)
{
    const kempe_branches *b = result;
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, b->system, kmp_status_word(b->status), "", b->system->build_s, b->warnings);
    kmp_json_array(&j, "kept");
    for (int k = 0; k < b->system->n; k++)
        if (b->kept[k])
            kmp_json_string(&j, NULL, b->system->model->motions[k].name);
    kmp_json_put(&j, "} starts %d closed %d more %d branches [", b->starts, b->closed, b->many);
    for (int k = 0; k < b->count; k++) {
        kmp_json_object(&j, NULL);
        kmp_print_entries(&j, "q", b->system, KMP_QUANTITY_Q, b->branch[k].q);
        kmp_json_put(&j, "residual %g sign %s hits %d }", b->branch[k].residual, b->branch[k].sign, b->branch[k].hits);
    }
    kmp_json_put(&j, "] }");
}

KMP_PRINT(kempe_branches, branches, branches->system->context, json_branches, show_branches)
