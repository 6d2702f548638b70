/* SPDX-License-Identifier: BSD-3-Clause */
/* What `check` and `assemble` say, for a person and as JSON. */
#include "constraints/diagnose.h"
#include "results/print.h"
#include <math.h>
#include <string.h>

/* -- check: text ------------------------------------------------------------------------------------- */

static void list_coordinates(kmp_text *text, const kempe_system *system, int count, const int *coordinates)
{
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", system->model->motions[coordinates[k]].name);
    kmp_text_put(text, count ? "" : "none");
}

static void list_rows(kmp_text *text, const kempe_system *system, int count, const int *rows)
{
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", system->row_names[rows[k]]);
    kmp_text_put(text, count ? "" : "none");
}

static void show_mobility(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    kmp_text_printf(text, "%s\n", check->system->model->name);
    kmp_text_printf(text, "  bodies               %d\n", check->body_count);
    kmp_text_printf(text, "  coordinates          %d\n", part->n);
    kmp_text_printf(text, "  closures             %d with %d rows, of rank %d\n", check->loop_count, part->m, part->r);
    kmp_text_printf(text, "  degrees of freedom   %d", part->p);
    if (part->n - part->m != part->p)
        kmp_text_printf(text, " (counting gives %d - %d = %d: rows are redundant)", part->n, part->m,
                        part->n - part->m);
    kmp_text_put(text, "\n  redundant rows       ");
    list_rows(text, check->system, part->m - part->r, part->redundant);
    kmp_text_put(text, "\n");
}

static void show_pivots(kmp_text *text, const kmp_partition *part)
{
    int count = part->m < part->n ? part->m : part->n;
    kmp_text_put(text, "  pivots               ");
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s%.3g", k == part->r ? "| " : "", k ? " " : "", part->pivots[k]);
    kmp_text_put(text, count ? "\n" : "none\n");
}

static void show_choice(kmp_text *text, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    kmp_text_put(text, "\n  independent, u       ");
    list_coordinates(text, check->system, part->p, part->u);
    kmp_text_put(text, "\n  dependent, v         ");
    list_coordinates(text, check->system, part->r, part->v);
    if (part->user)
        kmp_text_put(text, "\n  why                  asked for");
    else if (part->r == 0)
        kmp_text_put(text, "\n  why                  nothing closes a loop: all are independent");
    else
        kmp_text_put(text, "\n  why                  v has the largest pivots of the scaled J, so u moves v least");
    if (part->exchanges > 0)
        kmp_text_printf(text, ";\n%23sthen %d exchange%s of a u and a v where |Bvu| was above 2", "", part->exchanges,
                        part->exchanges == 1 ? "" : "s");
    kmp_text_put(text, "\n");
    show_pivots(text, part);
    kmp_text_printf(text, "  condition of Jv      %.3g\n", part->cond);
    kmp_text_printf(text, "  max |Bvu|            %.3g\n", part->max_b);
}

static void show_blocks(kmp_text *text, const kempe_check *check)
{
    kmp_text_put(text, "  blocks of Jv         ");
    for (int b = 0; b < check->block_count; b++) {
        int first = check->block_start[b];
        kmp_text_put(text, b ? " -> {" : "{");
        list_coordinates(text, check->system, check->block_start[b + 1] - first, check->block_column + first);
        kmp_text_put(text, "}");
    }
    kmp_text_put(text, check->block_count ? "\n" : "none\n");
}

/* -- check: JSON ------------------------------------------------------------------------------------- */

static void json_partition(kmp_json *json, const kempe_check *check)
{
    const kmp_partition *part = &check->part;
    const kempe_system *system = check->system;
    kmp_json_whole(json, "rank", part->r);
    kmp_json_whole(json, "dof", part->p);
    kmp_json_array(json, "redundant");
    for (int k = 0; k < part->m - part->r; k++)
        kmp_json_string(json, NULL, system->row_names[part->redundant[k]]);
    kmp_json_end(json);
    kmp_print_coordinates(json, "u", system, part->p, part->u);
    kmp_print_coordinates(json, "v", system, part->r, part->v);
    kmp_json_number(json, "cond_Jv", part->cond);
    kmp_json_number(json, "max_B", part->max_b);
    kmp_json_whole(json, "exchanges", part->exchanges);
    kmp_json_numbers(json, "pivots", part->m < part->n ? part->m : part->n, part->pivots);
}

static void json_check(kmp_text *text, const kempe_check *check)
{
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, check->system, KEMPE_OK, "", check->system->build_s);
    kmp_json_whole(&j, "nbody", check->body_count);
    kmp_json_whole(&j, "nq", check->part.n);
    kmp_json_whole(&j, "nh", check->part.m);
    json_partition(&j, check);
    kmp_json_array(&j, "blocks");
    for (int b = 0; b < check->block_count; b++) {
        int first = check->block_start[b];
        kmp_print_coordinates(&j, NULL, check->system, check->block_start[b + 1] - first, check->block_column + first);
    }
    kmp_json_end(&j);
    kmp_json_whole(&j, "loops", check->loop_count);
    kmp_json_end(&j);
}

kempe_status kempe_check_print(const kempe_check *check, kempe_format format, char **text)
{
    kmp_text out = {0};
    kmp_context_clear(check->system->context);
    if (format == KEMPE_JSON) {
        json_check(&out, check);
    } else {
        show_mobility(&out, check);
        show_choice(&out, check);
        show_blocks(&out, check);
    }
    return kmp_print_finish(check->system->context, &out, text);
}

/* -- assemble ---------------------------------------------------------------------------------------- */

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
