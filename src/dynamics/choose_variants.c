/* SPDX-License-Identifier: BSD-3-Clause */
/* Equations of equal value have many variants (variants.h), and the shortest is found by counting operations. Patterns
 * that follow from the tree are tried one after the other, each in addition to the best so far; with `optimize` also
 * each joint and body separately. The closures and their variants are found once: a trial returns to the graph that
 * has only them, and derives the dynamics. The result is derived once more: for runs in the same graph, otherwise in a
 * separate one.
 *
 * Of large mechanisms a second set of equations has mostly the same best variants as the first one: its search begins
 * there, and tries at most the first pattern. */
#include "dynamics/choose_variants.h"
#include "base/context.h"
#include "base/memory.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "model/data/model.h"
#include "symbolic/cost.h"
#include "symbolic/trig.h"
#include <limits.h>
#include <stddef.h>
#include <string.h>

/* Larger mechanisms are derived as they are; above LARGE motions fewer patterns are tried; the passes run in trials of
 * graphs of fewer than SMALL nodes. */
enum { MOST_MOTIONS = 128, LARGE = 40, ROUNDS = 4, SMALL = 3000, MOST_SEEN = 32 };

typedef struct search {
    const kempe_model *model;
    kmp_derivation_request scene; /* with the variants under trial */
    kmp_savings best, tried;
    kmp_equations *work; /* the closures, and the dynamics by the variants tried last */
    bool passes;         /* run before counting */
    bool shares;         /* trials share the closures */
    long least;
    uint64_t seen[MOST_SEEN]; /* digests of trials that were counted */
    int seen_count;
} search;

/* -- patterns ------------------------------------------------------------------------------------------ */

/* A value for each motion: of links whose parent has a mass, and of others. */
typedef struct pattern_set {
    size_t member; /* the array's offset in kmp_savings; 0: no more */
    uint8_t to_masses, to_others;
} pattern_set;

/* It changes variants in addition to those already chosen. */
typedef struct cost_pattern {
    enum { FOR_ALL, FOR_SMALL, ON_DEMAND } when; /* of any model; of small ones; on demand */
    bool instead;                                /* of the first pattern, whose members it sets otherwise */
    void (*apply)(const kmp_tree *tree, kmp_savings *savings);
    pattern_set set[4];
} cost_pattern;

static bool is_parallel(const kmp_tree *tree, int i)
{
    const kmp_link *link = &tree->links[i], *parent = &tree->links[link->parent];
    return link->parent > 0 && link->rotation && parent->rotation && link->axis == parent->axis && !link->turned;
}

/* Non-rotating axes for joints that follow one about the same axis. */
static void following(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            savings->stay[i - 1] = true;
}

/* Non-rotating axes for whole runs: such joints and the ones that they follow. */
static void runs(const kmp_tree *tree, kmp_savings *savings)
{
    following(tree, savings);
    for (int i = 1; i < tree->count; i++)
        if (is_parallel(tree, i))
            savings->stay[tree->links[i].parent - 1] = true;
}

/* Joints that carry no other joint, and are carried by one. */
static void leaves(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].rotation && tree->links[i].parent > 0 && kmp_tree_first_child(tree, i) == 0)
            savings->stay[i - 1] = true;
}

/* Bodies whose joint has no acceleration except gravity. */
static void on_the_ground(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        if (tree->links[i].rotation && tree->links[i].parent == 0)
            savings->about[i - 1] = true;
}

static void all_about(const kmp_tree *tree, kmp_savings *savings)
{
    for (int i = 1; i < tree->count; i++)
        savings->about[i - 1] = tree->links[i].mass != KMP_ZERO;
}

/* Masses on the axes, and inertia: what a composite body can always pass on. */
enum { MASS_AND_INERTIA = KMP_GIVE_MASS | KMP_GIVE_INERTIA };

#define ORIGINS offsetof(kmp_savings, origin)
#define GIVE    offsetof(kmp_savings, give)
#define LUMP    offsetof(kmp_savings, lump)

/* In the order in which they are tried. */
static const cost_pattern patterns[] = {
    /* The usual best choice: base parameters, and for the wrenches the gifts that join a mass. */
    {FOR_ALL, .set = {{ORIGINS, KMP_ORIGIN_PARENT, KMP_ORIGIN_PARENT},
                      {LUMP, MASS_AND_INERTIA, MASS_AND_INERTIA},
                      {GIVE, KMP_GIVE_ALL, 0}}},
    {FOR_ALL, .apply = leaves},
    {FOR_SMALL, .apply = following},
    {FOR_SMALL, .apply = runs},
    /* Masses are given through massless links, too, to the next link that has a mass. */
    {FOR_ALL, .set = {{GIVE, KMP_GIVE_ALL, KMP_GIVE_MASS}}},
    /* Wrenches about centres of mass, which suits forces that act there. */
    {FOR_ALL, .instead = true,
     .set = {{ORIGINS, KMP_ORIGIN_PARENT, KMP_ORIGIN_PARENT},
             {LUMP, MASS_AND_INERTIA, MASS_AND_INERTIA},
             {GIVE, KMP_GIVE_INERTIA, KMP_GIVE_INERTIA}}},
    {FOR_ALL, .apply = on_the_ground},
    {FOR_SMALL, .set = {{ORIGINS, KMP_ORIGIN_MASS, KMP_ORIGIN_MASS}}},
    {FOR_SMALL, .apply = all_about},
    {ON_DEMAND, .set = {{ORIGINS, KMP_ORIGIN_CHILD, KMP_ORIGIN_CHILD}}},
};

enum { PATTERNS = sizeof patterns / sizeof *patterns };

/* -- counting ---------------------------------------------------------------------------------------- */

int kmp_equations_most_outputs(const kmp_equations *eq)
{
    int n = eq->n, m = eq->m;
    return n * (4 * n + 7) + m * (2 * n + m + 4);
}

int kmp_equations_outputs(const kmp_equations *eq, unsigned sets, kmp_ref *out)
{
    int n = eq->n, m = eq->m, total = 0;
    const struct {
        unsigned set;
        int count;
        const kmp_ref *of;
    } list[] = {{KMP_SET_MASS, n * n, eq->dynamics.mass},
                {KMP_SET_BIAS, n, eq->dynamics.bias},
                {KMP_SET_PRODUCT, n, eq->dynamics.product},
                {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, m, eq->closures.h},
                {KMP_SET_CLOSURE | KMP_SET_RESIDUAL, m * n, eq->closures.jacobian},
                {KMP_SET_JDQD, m, eq->closures.jdqd},
                {KMP_SET_RESIDUAL, n, eq->dynamics.residual},
                {KMP_SET_RESIDUAL, n, eq->dynamics.jt_mu},
                {KMP_SET_RESIDUAL, m, eq->closures.hdot},
                {KMP_SET_INVERSE, n, eq->dynamics.inverse},
                {KMP_SET_INVERSE_Q, n * n, eq->dynamics.inverse_q},
                {KMP_SET_INVERSE_QD, n * n, eq->dynamics.inverse_qd},
                {KMP_SET_CLOSED, n, eq->dynamics.closed},
                {KMP_SET_CLOSED_Q, n * n, eq->dynamics.closed_q},
                {KMP_SET_ACCELERATION, n, eq->articulated.accelerations},
                {KMP_SET_ACCELERATION, m, eq->articulated.multipliers}};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        for (int i = 0; sets & list[k].set && i < list[k].count; i++)
            if (list[k].of[i] != KMP_ZERO)
                out[total++] = list[k].of[i];
    return total;
}

/* True if the same equations have been counted before: variants often differ where a model has nothing to vary. */
static bool is_seen(search *s, const kmp_equations *eq, int total, const kmp_ref *out)
{
    uint64_t digest = kmp_graph_digest(eq->graph, eq->mark.nodes, total, out);
    for (int k = 0; k < s->seen_count && k < MOST_SEEN; k++)
        if (s->seen[k] == digest)
            return true;
    s->seen[s->seen_count++ % MOST_SEEN] = digest;
    return false;
}

/* The operations of all requested sets as one program; LONG_MAX: no fewer than in an earlier trial; -1: no
 * memory. */
static long price_of(search *s, const kmp_equations *eq)
{
    kmp_ref *out = KMP_NEW(kmp_ref, kmp_equations_most_outputs(eq));
    kmp_cost cost = {.graph = eq->graph, .sum_price = s->passes ? 0 : KMP_COST_ADDITION};
    long found = -1;
    if (!out)
        return found;
    int total = kmp_equations_outputs(eq, s->scene.sets, out);
    if (s->passes && is_seen(s, eq, total, out))
        found = LONG_MAX;
    else if ((!s->passes || (kmp_equations_shorten(eq, total, out) && kmp_trig_sums(eq->graph, total, out))) &&
             kmp_cost_total(&cost, total, out)) {
        enum { EACH = 4, ONCE = 3 };
        found = EACH * (cost.operations - cost.once) + (s->scene.optimize ? 0 : ONCE * cost.once);
    }
    kmp_free(out);
    return found;
}

/* -- trials ------------------------------------------------------------------------------------------ */

/* Makes the current trial the best when it takes fewer operations. */
static kempe_status judge(search *s, bool *better)
{
    long found = price_of(s, s->work);
    KMP_TRY(kmp_made(s->model->context, found >= 0));
    if (found < s->least) {
        s->least = found;
        kmp_savings_copy(&s->best, &s->tried, s->model);
        *better = true;
    }
    return KEMPE_OK;
}

static bool has_first(const kmp_savings *savings)
{
    return savings->patterns & 1;
}

static kempe_status try_it(search *s, bool *better)
{
    if (kmp_savings_same(&s->tried, &s->best, s->model))
        return KEMPE_OK;
    if (s->shares) {
        KMP_TRY(kmp_equations_derive_again(s->work, &s->scene));
    } else {
        kmp_equations_free(s->work);
        KMP_TRY(kmp_equations_derive_once(s->work, s->model, &s->scene));
    }
    return judge(s, better);
}

/* Tries derived rows of closures: the closures' variants were found without the dynamics, which share more with derived
 * rows in the plane. */
static kempe_status try_plain_closures(search *s)
{
    bool better = false;
    if (!(s->scene.sets & (KMP_SET_MASS | KMP_SET_BIAS)) || s->model->closure_count == 0)
        return KEMPE_OK;
    kmp_savings_copy(&s->tried, &s->best, s->model);
    memset(s->tried.point, 0, 4 * (size_t)s->model->closure_count);
    if (!s->shares || !s->work->closures.derived)
        return s->shares ? KEMPE_OK : try_it(s, &better);
    kmp_equations_swap_derived(s->work);
    kempe_status status = judge(s, &better);
    if (!better)
        kmp_equations_swap_derived(s->work);
    return status;
}

bool kmp_equations_are_large(const kempe_model *model)
{
    return model->motion_count > LARGE;
}

/* Of large mechanisms few patterns are worth their time: none in place of the first one, where that has been taken. */
static bool is_worthwhile(const search *s, int k)
{
    const cost_pattern *pattern = &patterns[k];
    if (s->scene.optimize)
        return true;
    if (!kmp_equations_are_large(s->model))
        return pattern->when == FOR_ALL || pattern->when == FOR_SMALL;
    return pattern->when == FOR_ALL && !(s->scene.first && k > 0) && !(pattern->instead && has_first(&s->best));
}

static kempe_status try_patterns(search *s, bool *better)
{
    for (int k = 0; k < PATTERNS; k++) {
        if (!is_worthwhile(s, k))
            continue;
        kmp_savings_copy(&s->tried, &s->best, s->model);
        const cost_pattern *pattern = &patterns[k];
        if (pattern->apply)
            pattern->apply(&s->work->tree, &s->tried);
        for (const pattern_set *set = pattern->set; set->member; set++)
            for (int i = 1; i < s->work->tree.count; i++) {
                uint8_t *member = *(uint8_t **)((char *)&s->tried + set->member);
                bool joins = s->work->tree.links[s->work->tree.links[i].parent].mass != KMP_ZERO;
                member[i - 1] = joins ? set->to_masses : set->to_others;
            }
        s->tried.patterns |= 1u << k;
        KMP_TRY(try_it(s, better));
    }
    return KEMPE_OK;
}

/* -- joint by joint ---------------------------------------------------------------------------------- */

static const uint8_t gifts[] = {0, KMP_GIVE_MASS, KMP_GIVE_INERTIA, KMP_GIVE_MASS | KMP_GIVE_INERTIA, KMP_GIVE_ALL};
enum { GIFTS = sizeof gifts / sizeof *gifts };

/* Tries the gifts of one motion, to wrenches and to composite bodies. */
static kempe_status try_gifts(search *s, int motion, bool *better)
{
    uint8_t *const savings[] = {s->tried.give, s->tried.lump};
    for (int to = 0; to < (s->scene.sets & KMP_SET_MASS ? 2 : 1); to++)
        for (int v = 0; v < GIFTS; v++) {
            kmp_savings_copy(&s->tried, &s->best, s->model);
            savings[to][motion] = gifts[v];
            KMP_TRY(try_it(s, better));
        }
    return KEMPE_OK;
}

static kempe_status try_joints(search *s, bool *better)
{
    for (int k = 0; k < s->model->motion_count; k++) {
        if (s->model->motions[k].rotation) {
            kmp_savings_copy(&s->tried, &s->best, s->model);
            s->tried.stay[k] = !s->tried.stay[k];
            KMP_TRY(try_it(s, better));
        }
        for (int o = 0; o < KMP_ORIGINS; o++) {
            kmp_savings_copy(&s->tried, &s->best, s->model);
            s->tried.origin[k] = (uint8_t)o;
            KMP_TRY(try_it(s, better));
        }
        if (s->work->tree.links[k + 1].parent > 0)
            KMP_TRY(try_gifts(s, k, better));
    }
    return KEMPE_OK;
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* True if only sets are requested that can be derived again with unchanged closures. */
static bool can_share(const kmp_derivation_request *scene)
{
    const unsigned sets = KMP_SET_MASS | KMP_SET_PRODUCT | KMP_SET_BIAS | KMP_SET_INVERSE | KMP_SET_ACCELERATION |
                          KMP_SET_CLOSURE | KMP_SET_JDQD | KMP_SET_POWER;
    return !(scene->sets & ~(sets | (scene->then ? KMP_SET_REACTION : 0))); /* reactions are made with the closures */
}

static bool keep_copy(const search *s, const kmp_savings *of, kmp_savings *to)
{
    bool made = !to || kmp_savings_init(to, s->model);
    if (to && made)
        kmp_savings_copy(to, of, s->model);
    return made;
}

/* Searches from the equations as derived to the best variants. */
static kempe_status find(search *s)
{
    bool any = true;
    kmp_savings closures;
    bool ok = kmp_savings_init(&s->best, s->model);
    ok = kmp_savings_init(&s->tried, s->model) && ok;
    ok = kmp_savings_init(&closures, s->model) && ok;
    s->scene.savings = &s->tried;
    s->passes = kmp_graph_count(s->work->graph) < SMALL;
    s->shares = can_share(&s->scene);
    s->least = ok ? price_of(s, s->work) : -1;
    kempe_status status = kmp_made(s->model->context, s->least >= 0);
    if (status == KEMPE_OK) {
        kmp_savings_copy(&s->best, &s->work->savings, s->model);
        kmp_savings_copy(&closures, &s->work->savings, s->model);
        status = try_plain_closures(s);
    }
    for (int round = 0; status == KEMPE_OK && any && round < ROUNDS; round++) {
        any = false;
        status = try_patterns(s, &any);
        if (status == KEMPE_OK && s->scene.optimize)
            status = try_joints(s, &any);
        any = any && s->scene.optimize;
    }
    if (status == KEMPE_OK) {
        kmp_savings *found = s->scene.found;
        bool kept = keep_copy(s, &closures, found) && keep_copy(s, &s->best, s->scene.chosen);
        if (kept && found)
            kmp_savings_copy_dynamics(found, &s->best, s->model);
        status = kmp_made(s->model->context, kept);
    }
    kmp_savings_free(&closures);
    return status;
}

/* Derives the best variant. Runs take it in the graph of the trials, whose closures it shares; all others in a separate
 * graph, which has nothing of the search. */
static kempe_status derive_best(search *s, kmp_equations *eq)
{
    if (s->scene.then) {
        /* Derives the sets that follow the search, without variants. */
        kmp_savings_clear(&s->tried, s->model);
        s->scene.sets = s->scene.then;
        s->scene.savings = &s->tried;
    }
    if (!s->shares || !s->scene.quick)
        return kmp_equations_derive_once(eq, s->model, &s->scene);
    KMP_TRY(kmp_equations_derive_again(s->work, &s->scene));
    *eq = *s->work;
    *s->work = (kmp_equations){0};
    return KEMPE_OK;
}

kempe_status kmp_equations_derive(kmp_equations *eq, const kempe_model *model, const kmp_derivation_request *scene)
{
    const unsigned dynamic = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_INVERSE | KMP_SET_ACCELERATION | KMP_SET_INVERSE_Q |
                             KMP_SET_INVERSE_QD | KMP_SET_CLOSED | KMP_SET_CLOSED_Q;
    bool searches = !scene->plain && !scene->savings && model->flexible_count == 0 && scene->sets & dynamic &&
                    !(scene->sets & KMP_SET_RESIDUAL) && model->motion_count <= MOST_MOTIONS;
    kmp_derivation_request first = *scene;
    const bool begun = kmp_equations_are_large(model) && !scene->optimize && scene->first && scene->first->stay;
    first.first = searches && begun ? scene->first : NULL; /* of other sets, in a large mechanism */
    first.savings = first.first ? first.first : scene->savings;
    searches = searches && !(first.first && has_first(first.first));
    first.returns = scene->returns || (searches && can_share(scene));
    first.unloaded = searches && scene->quick && kmp_equations_are_large(model);
    if (!searches && scene->then)
        first.sets = scene->then;
    kempe_status status = kmp_equations_derive_once(eq, model, &first);
    if (status != KEMPE_OK || !searches)
        return status;
    kmp_equations work = *eq;
    search s = {.model = model, .scene = first, .work = &work};
    s.scene.returns = scene->returns;
    status = find(&s);
    if (status == KEMPE_OK) {
        s.scene.savings = &s.best;
        s.scene.unloaded = false;
        s.scene.nodes = kmp_graph_count(work.graph) / 2 * 3; /* with what the passes add */
        s.best.by_q = s.best.by_qd = scene->tangents;        /* once more, with the axes that were chosen */
        status = derive_best(&s, eq);
    }
    if (status != KEMPE_OK)
        *eq = (kmp_equations){0};
    kmp_equations_free(&work);
    kmp_savings_free(&s.best);
    kmp_savings_free(&s.tried);
    return status;
}
