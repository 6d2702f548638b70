/* SPDX-License-Identifier: BSD-3-Clause */
/* What `assemble` says, for a person and as JSON. */
#include "constraints/assemble.h"
#include "results/print.h"
#include <math.h>
#include <string.h>

/* "" when closed; else the loops that stay open, widest first. */
static void write_reason(kmp_text *reason, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    kmp_text_put(reason, "");
    for (int k = 0; !a->closed && k < a->culprit_count; k++) {
        int c = a->culprits[k];
        kmp_text_printf(reason, "%sloop '%s' stays open by %.3g", k ? ", " : "", model->closures[c].name, a->gaps[c]);
    }
    if (!a->closed && a->culprit_count == 0)
        kmp_text_printf(reason, "the loops do not close to the wanted precision: |h| = %.3g", a->residual);
}

static void show_coordinates(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    int width = kmp_print_width(a->system, KMP_QUANTITY_Q);
    kmp_text_printf(text, "  %-*s  unit  %22s  %22s  %22s\n", width, "", "guess", "q", "qd");
    for (int k = 0; k < a->system->n; k++)
        kmp_text_printf(text, "  %-*s  %-4s  %22.15g  %22.15g  %22.15g%s\n", width, model->motions[k].name,
                        kmp_print_unit(a->system, k), model->start.q[k].value, a->q[k], a->qd[k],
                        model->start.hold && model->start.hold[k] ? "  held" : "");
}

static void show_assembly(kmp_text *text, const kempe_assembly *a)
{
    const kempe_model *model = a->system->model;
    kmp_text_printf(text, "%s: %s after %d iteration%s\n\n", model->name, a->closed ? "assembled" : "not assembled",
                    a->iterations, a->iterations == 1 ? "" : "s");
    show_coordinates(text, a);
    kmp_text_put(text, "\nresidual  |h| ");
    kmp_print_cell(text, 0, 2, a->residual);
    kmp_text_put(text, " scaled, widest gap ");
    kmp_print_cell(text, 0, 2, a->gap);
    kmp_text_put(text, "\n");
    for (int k = 0; !a->closed && k < a->culprit_count; k++)
        kmp_text_printf(text, "open      loop '%s', gap %.6g\n", model->closures[a->culprits[k]].name,
                        a->gaps[a->culprits[k]]);
    if (a->rates_changed)
        kmp_text_put(text, "note      the rates given contradict the closures: they were corrected\n");
}

static void json_assembly(kmp_text *text, const kempe_assembly *a, const char *reason)
{
    const kempe_model *model = a->system->model;
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, a->system, a->closed ? KEMPE_OK : KEMPE_E_FAILED, reason, a->system->build_s);
    kmp_print_entries(&j, "q", a->system, KMP_QUANTITY_Q, a->q);
    kmp_print_entries(&j, "qd", a->system, KMP_QUANTITY_QD, a->qd);
    kmp_json_number(&j, "residual", a->residual);
    kmp_json_number(&j, "gap", a->gap);
    kmp_json_array(&j, "culprits");
    for (int k = 0; k < a->culprit_count; k++)
        kmp_json_string(&j, NULL, model->closures[a->culprits[k]].name);
    kmp_json_end(&j);
    kmp_json_whole(&j, "iterations", a->iterations);
    kmp_json_end(&j);
}

kempe_status kempe_assembly_print(const kempe_assembly *assembly, kempe_format format, char **text)
{
    kmp_text out = {0}, reason = {0};
    kmp_context_clear(assembly->system->context);
    write_reason(&reason, assembly);
    if (format == KEMPE_JSON)
        json_assembly(&out, assembly, reason.s);
    else
        show_assembly(&out, assembly);
    out.failed = out.failed || reason.failed;
    kmp_text_free(&reason);
    return kmp_print_finish(assembly->system->context, &out, text);
}
