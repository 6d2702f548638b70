/* SPDX-License-Identifier: BSD-3-Clause */
/* Other assembly modes: starts at random, closed one by one, kept where they differ from all before, and named by the
 * signs of the determinants of Jv's blocks. */
#include "constraints/closing/assembly_modes.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/mode_watch.h"
#include "constraints/evaluation/charts.h"
#include "constraints/tolerances.h"
#include "model/data/body.h"
#include "model/data/run_settings.h"
#include "model/data/start.h"
#include "model/read/loads.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STARTS = 200, STARTS_OF_LARGE = 50, LARGE = 40 };
#define TWO_PI   6.283185307179586
#define ROUNDING 1e-13
#define FAR      3.0 /* a translation is sampled within this many characteristic lengths */

/* -- states ------------------------------------------------------------------------------------------ */

bool kmp_state_same(const kempe_system *system, double within, int apart_count, const int *apart, const double *a,
                    const double *b)
{
    for (int c = 0; c < system->chart_count; c++)
        if (!(kmp_chart_apart(system, c, a, b) < within))
            return false;
    for (int k = 0; k < system->n; k++) {
        double off = (a[k] - b[k]) / system->scale[k];
        if (kmp_model_motion(system->model, k)->rotation)
            off = remainder(off, TWO_PI);
        if (fabs(off) < within || kmp_chart_of(system, k) >= 0)
            continue;
        int i = 0;
        while (i < apart_count && apart[i] != k)
            i++;
        if (i == apart_count)
            return false;
    }
    return true;
}

bool kmp_state_before(const kempe_system *system, double within, const double *a, const double *b)
{
    int k = 0;
    while (k < system->n && !(fabs(a[k] - b[k]) > within * system->scale[k]))
        k++;
    return k < system->n && a[k] < b[k];
}

kempe_status kmp_random_starts_next(kmp_random_starts *random, kempe_assembly **closed)
{
    const kempe_system *system = random->system;
    for (int k = 0; k < system->n; k++) {
        double reach = kmp_model_motion(system->model, k)->rotation ? TWO_PI / 2 : random->far * system->length;
        random->guess[k] = random->from[k];
        if (!random->still[k])
            random->guess[k] += reach * kmp_walk_random(&random->state);
    }
    kmp_guess guess = {random->guess, random->still, 0, false, 0};
    KMP_TRY(kmp_assemble_from(system, &guess, closed));
    random->starts++;
    if ((*closed)->closed) {
        random->closed++;
        return KEMPE_OK;
    }
    kempe_assembly_free(*closed);
    *closed = NULL;
    return KEMPE_OK;
}

/* -- search -------------------------------------------------------------------------------------------- */

typedef struct search {
    kempe_branches *b;
    kmp_evaluator *eval;
    kmp_mode_signs signs;
    int *order; /* n */
} search;

/* Chooses the kept coordinates: the held ones, or else the model's independent ones; then further coordinates of a good
 * choice, up to the number of degrees of freedom. */
static bool choose_kept(search *s)
{
    const kempe_system *system = s->b->system;
    const kempe_model *model = system->model;
    bool *kept = s->b->kept;
    int n = system->n, count = 0;
    for (int k = 0; k < n; k++) {
        kept[k] = kmp_model_start(model)->hold[k];
        count += kept[k] && !kmp_model_motion(model, k)->elastic;
    }
    for (int k = 0; count == 0 && k < kmp_model_run(model)->independent_count; k++)
        kept[kmp_model_run(model)->independent[k]] = true;
    for (int k = count = 0; k < n; k++)
        count += kept[k];
    /* At the assembled state, in the charts in which it was found, J has its rank. */
    const kempe_assembly *a = s->b->assembly;
    if (a->chart)
        kmp_eval_set_charts(s->eval, a->chart);
    kmp_eval_closure(s->eval, 0, a->inner_q ? a->inner_q : a->q);
    int free = kmp_partition_prefer(system, s->eval->jacobian, kept, s->order);
    for (int k = free - 1; k >= 0 && count < free; k--) {
        int c = kmp_chart_of(system, s->order[k]);
        if (c < 0 || !a->chart || kmp_chart_is_own(a->chart, c)) { /* in the user's own chart: not of a centred joint */
            count += !kept[s->order[k]];
            kept[s->order[k]] = true;
        }
    }
    return free >= 0;
}

/* -- one state --------------------------------------------------------------------------------------- */

/* Adds q to the list. */
static void add_branch(search *s, const double *q, double residual)
{
    const kempe_system *system = s->b->system;
    for (int k = 0; k < s->b->count; k++)
        if (kmp_state_same(system, KMP_SAME_STATE, 0, NULL, q, s->b->branch[k].q)) {
            s->b->branch[k].hits++;
            return;
        }
    if (s->b->count == KMP_MOST_BRANCHES) {
        s->b->many = true;
        return;
    }
    kmp_branch branch = {.residual = residual, .hits = 1};
    branch.q = KMP_ARENA_NEW(&s->b->arena, double, system->n);
    branch.sign = KMP_ARENA_NEW(&s->b->arena, char, s->signs.block_count + 1);
    if (!branch.q || !branch.sign)
        return;
    for (int k = 0; k < system->n; k++) {
        double off = q[k] - s->b->assembly->q[k];
        off = kmp_model_motion(system->model, k)->rotation ? remainder(off, TWO_PI) : off;
        branch.q[k] = s->b->assembly->q[k] + (fabs(off) < ROUNDING * system->scale[k] ? 0 : off);
    }
    kmp_mode_signs_evaluate(&s->signs, 0, branch.q);
    for (int k = 0; k < s->signs.block_count; k++)
        branch.sign[k] = kmp_mode_sign(&s->signs, k);
    s->b->branch[s->b->count++] = branch;
}

static kempe_status assemble_sample(search *s, int seed)
{
    kempe_branches *b = s->b;
    kmp_random_starts random = {.system = b->system, .from = b->assembly->q, .still = b->kept, .far = FAR};
    random.state = (unsigned)seed;
    random.guess = KMP_ARENA_NEW(&b->arena, double, b->system->n);
    int starts = b->system->n > LARGE ? STARTS_OF_LARGE : STARTS;
    add_branch(s, b->assembly->q, b->assembly->residual);
    while (b->starts < starts && !b->many && !b->arena.failed && !kmp_interrupted(b->system->context)) {
        kempe_assembly *a = NULL;
        KMP_TRY(kmp_random_starts_next(&random, &a));
        if (a)
            add_branch(s, a->q, a->residual);
        kempe_assembly_free(a);
        b->starts = random.starts;
        b->closed = random.closed;
        kmp_progress(b->system->context, KMP_PROGRESS_STUDY, b->starts, starts, "starts");
    }
    return KEMPE_OK;
}

static kempe_status search_branches(kempe_branches *b, int seed)
{
    const int n = b->system->n;
    search s = {.b = b, .eval = kmp_eval_new_of_closures(b->system)};
    kempe_status status = KEMPE_E_MEMORY;
    bool made = s.eval && KMP_ARENA_MAKE(&b->arena, KMP_ROOM(bool, n, &b->kept), KMP_ROOM(int, n, &s.order)) &&
                choose_kept(&s) && kmp_mode_signs_init(&s.signs, s.eval, b->kept) &&
                kmp_mode_signs_choose(&s.signs, b->kept, s.eval->jacobian);
    if (made) {
        status = assemble_sample(&s, seed);
        /* All but the first, by signs and then by states. */
        for (int i = 2; i < b->count; i++) {
            kmp_branch moved = b->branch[i];
            int k = i;
            for (; k > 1; k--) {
                const kmp_branch *before = &b->branch[k - 1];
                int order = strcmp(moved.sign, before->sign);
                if (order ? order > 0 : !kmp_state_before(b->system, KMP_SAME_STATE, moved.q, before->q))
                    break;
                b->branch[k] = *before;
            }
            b->branch[k] = moved;
        }
    }
    if (!made || b->arena.failed)
        status = kmp_fail_memory(b->system->context);
    kmp_mode_signs_free(&s.signs);
    kmp_eval_free(s.eval);
    return status;
}

kempe_status kempe_branches_new(const kempe_system *system, int seed, kempe_branches **branches)
{
    KMP_WANTED_BOTH(system, branches);
    kmp_model_begin(system->model);
    KMP_MAKE(system->context, kempe_branches, b);
    b->system = system;
    kempe_status status = kmp_assembly_at_start(system, &b->assembly);
    if (status == KEMPE_OK)
        status = search_branches(b, seed);
    b->warnings = kmp_context_warnings(system->context);
    b->status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, branches, b, kempe_branches_free);
}

void kempe_branches_free(kempe_branches *branches)
{
    if (!branches)
        return;
    kempe_assembly_free(branches->assembly);
    kmp_free(branches->warnings);
    kmp_arena_free(&branches->arena);
    kmp_free(branches);
}

KMP_GETTER(int kempe_branches_count(const kempe_branches *branches), branches, branches->count, 0)
KMP_GETTER_AT(const double *kempe_branches_q(const kempe_branches *branches, int k), branches, k, branches->count,
              branches->branch[k].q, NULL)
