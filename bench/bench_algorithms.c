/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations + - * / of a right-hand side of the reduced formulation by each algorithm, whatever `auto` takes: M column
 * by column (ner) and by composite bodies, products M x in place of M, articulated bodies that carry the multipliers.
 * By M the least of four solutions counts: the reduced mass or the sparse saddle system, with the program's values or
 * written out as one program. With products it is the reduced mass. All factor Jv once. A line of CSV a model, for
 * bench/loop_counts.py. An algorithm that is impossible has no number.
 *
 *     bench algorithms MODEL ...
 */
#include "bench.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/saddle.h"
#include "constraints/programs/reduced_program.h"
#include "dynamics/choose_variants.h"
#include "dynamics/motion.h"
#include "linalg/sparse.h"
#include <kempe/check.h>
#include <kempe/settings.h>

enum { NONE = -1 };

static long count_program(const kmp_program *program, int first, int last)
{
    return kmp_program_count(program, first, last).paper;
}

static long sum(kmp_flops f)
{
    return f.add + f.mul + f.div;
}

static long least(long a, long b)
{
    return a == NONE || (b != NONE && b < a) ? b : a;
}

/* A mechanism at its start, with its choice of independent coordinates and the factors of Jv. */
typedef struct placed {
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_reduction red;
} placed;

static bool place(placed *at, const kempe_system *s, const double *q)
{
    if (!at->eval)
        return false;
    kmp_eval_closure(at->eval, 0, q);
    return kmp_partition_init(&at->part, s, at->eval->jacobian, NULL, 0) == KEMPE_OK &&
           kmp_reduction_init(&at->red, at->eval, &at->part) == KEMPE_OK && kmp_reduction_factor(&at->red) == 0;
}

static void leave(placed *at)
{
    kmp_reduction_free(&at->red);
    kmp_partition_free(&at->part);
    kmp_eval_free(at->eval);
}

/* Jv, and the rates of v by one solution with its factors. */
static long count_rates(const kmp_reduction *red)
{
    return red->r > 0 ? sum(kmp_block_factor_flops(red->block)) + sum(kmp_block_solve_flops(red->block, NULL)) : 0;
}

/* The sparse factors of [M -J'; J 0] and a solution; NONE: there are none. */
static long count_saddle(placed *at)
{
    kmp_saddle saddle;
    long count = NONE;
    if (kmp_saddle_init(&saddle, at->eval, &at->part)) {
        if (saddle.sparse)
            count = (long)kmp_sparse_operations(saddle.sparse) + count_rates(&at->red);
        kmp_saddle_free(&saddle);
    }
    return count;
}

/* The right-hand side as one program; NONE: there is none. */
static long count_written(const kmp_reduction *red, bool by_saddle)
{
    kmp_reduced_program *written = NULL;
    long count = NONE;
    kempe_status status = by_saddle ? kmp_reduced_program_new_by_saddle(&written, red, false)
                                    : kmp_reduced_program_new(&written, red, false);
    if (status == KEMPE_OK && written)
        count = count_program(kmp_reduced_program_code(written), KMP_REDUCED_PROGRAM_RATES,
                              KMP_REDUCED_PROGRAM_ACCELERATIONS);
    kmp_reduced_program_free(written);
    return count;
}

/* By M, from a system of ner or composite at its start. */
static long count_by_mass(const kempe_system *s, const double *q)
{
    placed at = {.eval = kmp_eval_new(s, "tape")};
    long count = NONE;
    if (place(&at, s, q)) {
        count = least(kmp_reduction_count(&at.red).paper, count_saddle(&at)) +
                count_program(s->motion, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
        count = least(count, least(count_written(&at.red, false), count_written(&at.red, true)));
    }
    leave(&at);
    return count;
}

/* The equations with products: a system that has these and the closures alone. */
static kempe_system *make_products(const kempe_model *model)
{
    kempe_system *s = kmp_system_start(model);
    kmp_lazy_equations *late = s ? kmp_lazy_equations_new(s) : NULL;
    if (!late) {
        kempe_system_free(s);
        return NULL;
    }
    const kmp_derivation_request request = {.sets = KMP_SET_CLOSURE | KMP_SET_PRODUCT | KMP_SET_BIAS | KMP_SET_JDQD,
                                            .quick = true,
                                            .events = &s->events,
                                            .charted = true};
    kmp_equations eq;
    s->late = late;
    late->by_products = true;
    if (kmp_equations_derive(&eq, model, &request) == KEMPE_OK) {
        if (kmp_system_set_rows(s, eq.n, eq.m, eq.closures.rows, eq.closures.misfit) &&
            kmp_motion_make_weighing(s, &eq))
            s->closing = kmp_program_first(late->weighing, KMP_STAGE_MASS);
        kmp_equations_free(&eq);
    }
    if (!s->closing) {
        kempe_system_free(s);
        return NULL;
    }
    return s;
}

/* By products: M a0 and each column of M X is a run of the product's stage. */
static long count_by_products(const kempe_model *model, const double *q)
{
    kempe_system *s = make_products(model);
    placed at = {.eval = s ? kmp_eval_new_of_closures(s) : NULL};
    long count = NONE;
    if (at.eval)
        at.eval->by_products = true; /* what is counted and written needs no values beyond the closures */
    if (s && place(&at, s, q)) {
        count =
            count_program(s->late->weighing, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS) + kmp_reduction_count(&at.red).paper;
        count = least(count, count_written(&at.red, false));
    }
    leave(&at);
    kempe_system_free(s);
    return count;
}

static long count_by_bodies(const kempe_model *model, const kempe_system *composite, const double *q)
{
    kempe_system *s = NULL;
    placed at = {.eval = kmp_eval_new(composite, "tape")};
    long count = NONE;
    if (kempe_system_new_with_algorithm(model, "articulated", &s) == KEMPE_OK && place(&at, composite, q))
        count = count_program(s->bodies->program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS) + count_rates(&at.red);
    leave(&at);
    kempe_system_free(s);
    return count;
}

static const char *taken_by_auto(const kempe_model *model)
{
    kempe_system *s = NULL;
    const char *word = "";
    if (kempe_system_new_with_algorithm(model, "auto", &s) == KEMPE_OK && kmp_motion_need_bodies(s) == KEMPE_OK)
        word = s->late && s->late->by_products ? "products" : s->bodies->program ? "articulated" : "composite";
    kempe_system_free(s);
    return word;
}

static void put(long count)
{
    if (count == NONE)
        printf(",");
    else
        printf(",%ld", count);
}

static bool count_model(const kempe_model *model)
{
    kempe_system *ner = NULL, *composite = NULL;
    kempe_assembly *start = NULL;
    bool ok = kempe_system_new_with_algorithm(model, "composite", &composite) == KEMPE_OK &&
              kempe_system_new_with_algorithm(model, "ner", &ner) == KEMPE_OK &&
              kempe_assembly_new(composite, &start) == KEMPE_OK;
    if (ok) {
        printf("%s,%d,%d", kempe_model_name(model), composite->n, composite->m);
        put(count_by_mass(ner, start->q));
        put(count_by_mass(composite, start->q));
        put(composite->m > 0 ? count_by_products(model, start->q) : NONE);
        put(count_by_bodies(model, composite, start->q));
        printf(",%s\n", taken_by_auto(model));
        fflush(stdout);
    }
    kempe_assembly_free(start);
    kempe_system_free(ner);
    kempe_system_free(composite);
    return ok;
}

int bench_algorithms(int argc, char **argv)
{
    bool ok = argc > 1;
    printf("model,n,m,ner,composite,products,articulated,auto\n");
    for (int k = 1; k < argc; k++) {
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        bool counted = kempe_model_read(context, argv[k], &model) == KEMPE_OK && count_model(model);
        if (!counted)
            fprintf(stderr, "%s: %s\n", argv[k], kempe_context_message(context));
        ok = ok && counted;
        kempe_model_free(model);
        kempe_context_free(context);
    }
    return !ok;
}
