/* SPDX-License-Identifier: BSD-3-Clause */
/* The same equations can be written in axes that turn with a joint or stay behind it: about parallel axes vectors then
 * need not be turned there and back, but what is fixed to the body is. Which is shorter shows by counting: some
 * patterns that follow from the tree are tried; with `optimize` also each joint by itself. The closures' ways are found
 * once. */
#include "base/context.h"
#include "base/memory.h"
#include "dynamics/equations.h"
#include "symbolic/cost.h"

/* Larger mechanisms are derived as they are. */
enum { MOST_MOTIONS = 128, LARGE = 40, PASSES = 3, SMALL = 3000 };

/* -- patterns ---------------------------------------------------------------------------------------- */

static bool is_parallel(const kmp_tree *tree, int i)
{
    const kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    return link->parent > 0 && link->rotation && parent->rotation && link->axis == parent->axis && !link->turned;
}

/* Joints that follow one about the same axis. */
static void following(const kmp_tree *tree, bool *stay)
{
    for (int i = 1; i < tree->count; i++)
        stay[i - 1] = is_parallel(tree, i);
}

/* Those and the ones that they follow. */
static void runs(const kmp_tree *tree, bool *stay)
{
    following(tree, stay);
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            stay[tree->links[i].parent - 1] = true;
}

/* Joints that carry no other, and are carried. */
static void leaves(const kmp_tree *tree, bool *stay)
{
    for (int i = 1; i < tree->count; i++)
        stay[i - 1] = tree->links[i].rotation && tree->links[i].parent > 0;
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].parent > 0)
            stay[tree->links[i].parent - 1] = false;
}

/* Bodies whose joint has no acceleration but that of gravity. */
static void on_the_ground(const kmp_tree *tree, bool *about)
{
    for (int i = 1; i < tree->count; i++)
        about[i - 1] = tree->links[i].rotation && tree->links[i].parent == 0;
}

static void all(const kmp_tree *tree, bool *about)
{
    for (int i = 1; i < tree->count; i++)
        about[i - 1] = tree->links[i].mass != KMP_ZERO;
}

typedef void pattern(const kmp_tree *tree, bool *of);

/* -- counting ---------------------------------------------------------------------------------------- */

int kmp_equations_most_outputs(const kmp_equations *eq)
{
    int n = eq->n, m = eq->m;
    return n * (4 * n + 6) + m * (2 * n + m + 4);
}

int kmp_equations_outputs(const kmp_equations *eq, unsigned sets, kmp_ref *out)
{
    int n = eq->n, m = eq->m, total = 0;
    const struct {
        unsigned set;
        int count;
        const kmp_ref *of;
    } list[] = {{KMP_SET_MASS, n * n, eq->mass},
                {KMP_SET_BIAS, n, eq->bias},
                {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, m, eq->h},
                {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, m * n, eq->jacobian},
                {KMP_SET_JDQD, m, eq->jdqd},
                {KMP_SET_RESIDUAL, n, eq->residual},
                {KMP_SET_RESIDUAL, n, eq->jt_mu},
                {KMP_SET_RESIDUAL, m, eq->hdot},
                {KMP_SET_INVERSE, n, eq->inverse},
                {KMP_SET_INVERSE_Q, n * n, eq->inverse_q},
                {KMP_SET_INVERSE_QD, n * n, eq->inverse_qd},
                {KMP_SET_CLOSED, n, eq->closed},
                {KMP_SET_CLOSED_Q, n * n, eq->closed_q},
                {KMP_SET_ACCELERATION, n, eq->free_qdd},
                {KMP_SET_ACCELERATION, m * n, eq->compliance},
                {KMP_SET_ACCELERATION, m * m, eq->mobility},
                {KMP_SET_ACCELERATION, m, eq->drift}};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        for (int i = 0; sets & list[k].set && i < list[k].count; i++)
            if (list[k].of[i] != KMP_ZERO)
                out[total++] = list[k].of[i];
    return total;
}

/* Operations of all that was asked for, together, for small mechanisms after the passes; -1: no memory. */
static long operations(const kmp_equations *eq, unsigned sets)
{
    kmp_ref *out = KMP_NEW(kmp_ref, kmp_equations_most_outputs(eq));
    long count = -1;
    if (out) {
        int total = kmp_equations_outputs(eq, sets, out);
        bool small = kmp_graph_count(eq->graph) < SMALL;
        if (!small || kmp_equations_shorten(eq, total, out))
            count = kmp_cost_of(eq->graph, small ? 0 : KMP_COST_ADDITION, total, out);
    }
    kmp_free(out);
    return count;
}

typedef struct search {
    const kempe_model *model;
    kmp_equations *first; /* as they come; shared, with the closures' best ways */
    kmp_scene scene;      /* with the ways that are tried */
    bool shares;          /* trials are written into the graph of the first equations, closures and all */
    kmp_ways best, tried;
    long least;
} search;

static void copy_ways(const search *s, kmp_ways *to, const kmp_ways *from)
{
    for (int k = 0; k < s->model->motion_count; k++) {
        to->stay[k] = from->stay[k];
        to->about[k] = from->about[k];
    }
    for (int k = 0; k < 4 * s->model->closure_count; k++)
        to->way[k] = from->way[k];
    to->by_q = from->by_q;
    to->by_qd = from->by_qd;
}

/* Takes what is tried for the best when it has fewer operations. */
static kempe_status judge(search *s, const kmp_equations *eq, bool *better)
{
    long count = operations(eq, s->scene.sets);
    *better = count >= 0 && count < s->least;
    if (*better) {
        s->least = count;
        copy_ways(s, &s->best, &s->tried);
    }
    return count < 0 ? kmp_fail_memory(s->model->context) : KEMPE_OK;
}

static kempe_status try_it(search *s, bool *better)
{
    kmp_equations eq;
    *better = false;
    if (s->shares) {
        kempe_status again = kmp_equations_derive_again(s->first, &s->scene);
        return again == KEMPE_OK ? judge(s, s->first, better) : again;
    }
    kempe_status status = kmp_equations_derive_once(&eq, s->model, &s->scene);
    if (status != KEMPE_OK)
        return status;
    status = judge(s, &eq, better);
    kmp_equations_free(&eq);
    return status;
}

/* The closures' ways were found without the dynamics, which share more with derived rows in the plane. */
static kempe_status try_plain_closures(search *s)
{
    bool better;
    if (!(s->scene.sets & (KMP_SET_MASS | KMP_SET_BIAS)) || s->model->closure_count == 0)
        return KEMPE_OK;
    for (int k = 0; k < 4 * s->model->closure_count; k++)
        s->tried.way[k] = 0;
    if (!s->shares || !s->first->derived)
        return s->shares ? KEMPE_OK : try_it(s, &better);
    kmp_equations_swap_derived(s->first);
    kempe_status status = judge(s, s->first, &better);
    if (!better)
        kmp_equations_swap_derived(s->first);
    return status;
}

/* Patterns of one kind, each with what is best so far. */
static kempe_status try_patterns(search *s, bool *of, int count, pattern *const *patterns)
{
    kempe_status status = KEMPE_OK;
    bool better, *apply = KMP_NEW(bool, s->model->motion_count);
    if (!apply)
        return kmp_fail_memory(s->model->context);
    for (int k = 0; k < count && status == KEMPE_OK; k++) {
        bool any = false;
        copy_ways(s, &s->tried, &s->best);
        patterns[k](&s->first->tree, apply);
        for (int i = 0; i < s->model->motion_count; i++) {
            any = any || (apply[i] && !of[i]);
            of[i] = of[i] || apply[i];
        }
        if (any)
            status = try_it(s, &better);
    }
    kmp_free(apply);
    return status;
}

/* Each joint and body the other way, as long as it helps. */
static kempe_status try_joints(search *s)
{
    kempe_status status = KEMPE_OK;
    bool better, any = true;
    int n = s->model->motion_count;
    for (int pass = 0; any && pass < PASSES; pass++) {
        any = false;
        for (int k = 0; k < 2 * n && status == KEMPE_OK; k++) {
            bool applies = k < n ? s->model->motions[k].rotation : s->first->tree.links[k - n + 1].mass != KMP_ZERO;
            copy_ways(s, &s->tried, &s->best);
            bool *flag = k < n ? &s->tried.stay[k] : &s->tried.about[k - n];
            *flag = !*flag;
            if (applies)
                status = try_it(s, &better);
            any = any || (applies && better);
        }
    }
    return status;
}

/* Whether nothing is asked for but what may be written anew beside closures that stay, and so much that the passes are
 * left out of the count. */
static bool can_share(const search *s)
{
    const unsigned sets =
        KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_INVERSE | KMP_SET_ACCELERATION | KMP_SET_CLOSURE | KMP_SET_JDQD;
    return !(s->scene.sets & ~sets) && kmp_graph_count(s->first->graph) >= 2 * SMALL;
}

/* From equations as they come to the best ones found. */
static kempe_status find(search *s)
{
    static pattern *const axes[] = {leaves, following, runs};
    static pattern *const bodies[] = {on_the_ground, all};
    size_t n = (size_t)s->model->motion_count;
    bool large = n > LARGE; /* fewer patterns, those that mostly gain */
    size_t closures = 4 * (size_t)s->model->closure_count;
    s->best = (kmp_ways){KMP_NEW(bool, n), KMP_NEW(bool, n), KMP_NEW(uint8_t, closures), s->first->ways.by_q,
                         s->first->ways.by_qd};
    s->tried = (kmp_ways){KMP_NEW(bool, n), KMP_NEW(bool, n), KMP_NEW(uint8_t, closures), s->first->ways.by_q,
                          s->first->ways.by_qd};
    s->scene.ways = &s->tried;
    s->least = operations(s->first, s->scene.sets);
    bool ok = s->best.stay && s->best.about && s->best.way && s->tried.stay && s->tried.about && s->tried.way;
    if (!ok || s->least < 0)
        return kmp_fail_memory(s->model->context);
    for (size_t k = 0; k < closures; k++)
        s->best.way[k] = s->first->ways.way[k];
    s->shares = large && can_share(s);
    kempe_status status = try_plain_closures(s);
    if (status == KEMPE_OK)
        status = try_patterns(s, s->tried.stay, large ? 2 : 3, axes);
    if (status == KEMPE_OK)
        status = try_patterns(s, s->tried.about, 2, bodies);
    s->shares = false; /* joint by joint there would be too much in one graph */
    if (status == KEMPE_OK && s->scene.optimize)
        status = try_joints(s);
    return status;
}

static void free_ways(kmp_ways *w)
{
    kmp_free(w->stay);
    kmp_free(w->about);
    kmp_free(w->way);
}

kempe_status kmp_equations_derive(kmp_equations *eq, const kempe_model *model, const kmp_scene *scene)
{
    kempe_status status = kmp_equations_derive_once(eq, model, scene);
    const unsigned dynamic = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_INVERSE | KMP_SET_ACCELERATION | KMP_SET_INVERSE_Q |
                             KMP_SET_INVERSE_QD | KMP_SET_CLOSED | KMP_SET_CLOSED_Q;
    if (status != KEMPE_OK || scene->ways || !(scene->sets & dynamic) || scene->sets & KMP_SET_RESIDUAL ||
        model->motion_count > MOST_MOTIONS)
        return status;
    kmp_equations first = *eq;
    search s = {.model = model, .first = &first, .scene = *scene};
    status = find(&s);
    if (status == KEMPE_OK) {
        s.scene.ways = &s.best;
        s.best.by_q = s.best.by_qd = scene->tangents; /* once more, with the axes that were chosen */
        status = kmp_equations_derive_once(eq, model, &s.scene);
    }
    if (status != KEMPE_OK)
        *eq = (kmp_equations){0};
    kmp_equations_free(&first);
    free_ways(&s.best);
    free_ways(&s.tried);
    return status;
}
