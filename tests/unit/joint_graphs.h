/* SPDX-License-Identifier: BSD-3-Clause */
/* Graphs of joints as the tests of them need them: read, with the kinds of joints there are, and run. */
#ifndef KEMPE_TESTS_JOINT_GRAPHS_H
#define KEMPE_TESTS_JOINT_GRAPHS_H

#include "base/text.h"
#include "constraints/evaluation/evaluator.h"
#include "studies/simulate/observed.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>

static kempe_context *context;

static inline kempe_model *read_text(const char *text)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text(context, text, "text", &model) != KEMPE_OK)
        printf("%s\n%s\n", kempe_context_message(context), text);
    CHECK(model != NULL);
    return model;
}

static inline kempe_model *read_file(const char *name)
{
    kempe_model *model = NULL;
    char path[512];
    snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, name);
    if (kempe_model_read(context, path, &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

/* A row of joints.def with that of cuts.def, which may be missing. */
typedef struct joint_kind {
    const char *name, *chain, *closure;
    int rows;
} joint_kind;

static inline bool joint_kind_at(int k, joint_kind *kind)
{
    static const joint_kind joints[] = {
#define KMP_JOINT(name, chain) {#name, chain, NULL, 0},
#include "model/data/joints.def"
#undef KMP_JOINT
    };
    static const joint_kind cuts[] = {
#define KMP_CUT(joint, closure, rows, axes) {#joint, NULL, #closure, rows},
#include "model/data/cuts.def"
#undef KMP_CUT
    };
    if (k >= (int)(sizeof joints / sizeof *joints))
        return false;
    *kind = joints[k];
    for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++)
        if (strcmp(cuts[i].name, kind->name) == 0) {
            kind->closure = cuts[i].closure;
            kind->rows = cuts[i].rows;
        }
    return true;
}

static const char four_bar[] =
    "kempe: 1\ngravity: [0, -9.81, 0]\n"
    "parameters: {crank: 0.3, coupler: 0.8, rocker: 0.7, base: 0.9, crank_mass: 1, coupler_mass: 1, rocker_mass: 1,\n"
    "  diagonal: sqrt(base^2 + crank^2), along: (coupler^2 - rocker^2 + diagonal^2)/(2*diagonal),\n"
    "  across: sqrt(coupler^2 - along^2), Cx: (along*base + across*crank)/diagonal,\n"
    "  Cy: crank + (across*base - along*crank)/diagonal}\n"
    "ground: {points: {O: [0, 0, 0], D: [base, 0, 0]}}\n"
    "bodies:\n"
    "  crank: {mass: crank_mass, com: [0, crank/2, 0], inertia: {zz: crank_mass*crank^2/12},\n"
    "          points: {O: [0, 0, 0], B: [0, crank, 0]}}\n"
    "  coupler: {mass: coupler_mass, com: [Cx/2, (Cy - crank)/2, 0], inertia: {zz: coupler_mass*coupler^2/12},\n"
    "            points: {O: [0, 0, 0], C: [Cx, Cy - crank, 0]}}\n"
    "  rocker: {mass: rocker_mass, com: [(Cx - base)/2, Cy/2, 0], inertia: {zz: rocker_mass*rocker^2/12},\n"
    "           points: {O: [0, 0, 0], C: [Cx - base, Cy, 0]}}\n";

static inline kempe_model *read_two(const char *head, const char *tail)
{
    kmp_text text = {0};
    kmp_text_printf(&text, "%s%s", head, tail);
    kempe_model *model = read_text(text.s ? text.s : "");
    kmp_text_free(&text);
    return model;
}

enum { MOST_COLUMNS = 64 };

/* The outputs at the first and the last row of a run, without the time; their number, 0 when it failed. */
static inline int run_text(const char *text, const char *formulation, double t_end, double rtol, double *first,
                           double *last)
{
    kempe_model *model = read_text(text);
    kempe_system *system = NULL;
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    kmp_columns columns = {0};
    int count = 0;
    run.formulation = formulation;
    run.t_end = run.output_step = t_end;
    run.rtol = rtol;
    bool good = model && kempe_system_new(model, &system) == KEMPE_OK && kempe_simulate(system, &run, &t) == KEMPE_OK;
    if (!good)
        printf("%s\n%s\n", kempe_context_message(context), text);
    CHECK(good);
    kmp_evaluator *eval = good ? kmp_eval_new(system, "tape") : NULL;
    if (eval && kmp_columns_init(&columns, system, model, NULL) && columns.count <= MOST_COLUMNS) {
        kmp_columns_fill(&t->table, &columns, eval, 0, first);
        kmp_columns_fill(&t->table, &columns, eval, kempe_trajectory_row_count(t) - 1, last);
        count = columns.count - 1;
        memmove(first, first + 1, (size_t)count * sizeof *first);
        memmove(last, last + 1, (size_t)count * sizeof *last);
    }
    kmp_columns_free(&columns);
    kmp_eval_free(eval);
    kempe_trajectory_free(t);
    kempe_system_free(system);
    kempe_model_free(model);
    return count;
}

#endif
