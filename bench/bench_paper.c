/* SPDX-License-Identifier: BSD-3-Clause */
/* Figures of Fisette and Samin 1996, section 3.2, beside Kempe's: steps of the recursive scheme one after the other and
 * in vectors, and the share of its equations that nothing needs. The scheme is the paper's (columns A_M, O_M, F_M,
 * L_M), numbers are kept as symbols. Equations are its named scalars (components of omega, beta, alpha, F, L and of the
 * columns); one that is used once stands in its user; sines and cosines are there before the first step. The paper's
 * pendulum is not described further than that it has 9 degrees of freedom in space; so there are several here. */
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "studies/show/sets.h"

#include "base/memory.h"
#include "bench.h"
#include "exchange/code/vectorised.h"
#include "symbolic/live.h"
#include <kempe/generate.h>
#include <kempe/settings.h>
#include <string.h>

static kempe_context *context;

/* -- the equations as they come from the scheme -------------------------------------------------------- */

typedef struct scheme {
    kmp_equations eq;
    int count;
    kmp_ref *out;
    uint8_t *live; /* by node */
} scheme;

static void scheme_free(scheme *s)
{
    kmp_free(s->out);
    kmp_free(s->live);
    kmp_equations_free(&s->eq);
}

static void stop(const char *what)
{
    fprintf(stderr, "%s %s\n", what, kempe_context_message(context));
    exit(1);
}

/* No axes stay, nothing is tried, no passes: derived once. */
static void scheme_init(scheme *s, const kempe_model *model, unsigned sets, bool inputs)
{
    kmp_savings plain;
    bool ready = kmp_savings_init(&plain, model);
    const kmp_derivation_request scene = {.sets = kmp_sets_derive(sets),
                                          .scheme = KMP_SCHEME_NER,
                                          .keep = KMP_KEEP_NUMBERS,
                                          .body_inputs = inputs,
                                          .labels = true,
                                          .loops_alone = true,
                                          .savings = &plain};
    *s = (scheme){0};
    if (!ready || kmp_equations_derive_once(&s->eq, model, &scene) != KEMPE_OK)
        stop("not derived:");
    s->count = kmp_sets_size(&s->eq, sets);
    s->out = KMP_NEW(kmp_ref, s->count);
    s->live = KMP_NEW(uint8_t, kmp_graph_count(s->eq.graph));
    kmp_assignment *entry = KMP_NEW(kmp_assignment, s->count);
    if (!s->out || !s->live || !entry)
        stop("no memory");
    kmp_sets_put(&s->eq, sets, entry);
    for (int k = 0; k < s->count; k++)
        s->out[k] = entry[k].value;
    kmp_live_mark(s->eq.graph, s->count, s->out, s->live);
    kmp_free(entry);
    kmp_savings_free(&plain);
}

/* Quantities computed at every state. */
static bool moves(const kmp_node *n)
{
    return kmp_op_arity((kmp_op)n->op) > 0 && n->depends & ~(1u << KMP_IN_PARAMETER);
}

static bool is_operation(const kmp_node *n)
{
    return n->op == KMP_OP_ADD || n->op == KMP_OP_MUL || n->op == KMP_OP_DIV;
}

static bool is_trig(const kmp_node *n)
{
    return n->op == KMP_OP_SIN || n->op == KMP_OP_COS;
}

/* -- steps ------------------------------------------------------------------------------------------- */

typedef struct steps {
    long assignments, outputs, trig, levels, shared; /* shared: assignments, if any shared value is one */
} steps;

enum { MANY = 1000000 };

/* The number of assignments that contain each node, when equations that are used once and nodes without a name are
 * written out. Outputs count as used by two. */
static long *occurrences(const scheme *s)
{
    const kmp_graph *g = s->eq.graph;
    uint32_t nodes = kmp_graph_count(g);
    long *times = KMP_NEW(long, nodes);
    if (!times)
        stop("no memory");
    for (int k = 0; k < s->count; k++)
        times[kmp_id(s->out[k])] = 2;
    for (uint32_t id = nodes; id-- > 0;) {
        const kmp_node *n = kmp_graph_node(g, id);
        bool named = kmp_graph_label_of(g, id) && times[id] > 1;
        for (int k = 0; times[id] && k < kmp_op_arity((kmp_op)n->op); k++) {
            long *below = &times[kmp_id(kmp_operand(n, k))];
            *below += named || times[id] == 2 ? 1 : times[id];
            *below = *below > MANY ? MANY : *below;
        }
    }
    return times;
}

static steps count_steps(const scheme *s)
{
    const kmp_graph *g = s->eq.graph;
    uint32_t nodes = kmp_graph_count(g);
    long *times = occurrences(s), *level = KMP_NEW(long, nodes);
    uint8_t *is_output = KMP_NEW(uint8_t, nodes);
    steps found = {0};
    if (!level || !is_output)
        stop("no memory");
    for (int k = 0; k < s->count; k++)
        is_output[kmp_id(s->out[k])] = moves(kmp_graph_node(g, kmp_id(s->out[k])));
    for (uint32_t id = 0; id < nodes; id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        if (!s->live[id] || !moves(n))
            continue;
        found.trig += is_trig(n);
        for (int k = 0; !is_trig(n) && k < kmp_op_arity((kmp_op)n->op); k++)
            if (level[kmp_id(kmp_operand(n, k))] > level[id])
                level[id] = level[kmp_id(kmp_operand(n, k))];
        bool variable = is_output[id] || (kmp_graph_label_of(g, id) && times[id] > 1);
        level[id] += variable;
        found.assignments += variable;
        found.outputs += is_output[id];
        found.levels = level[id] > found.levels ? level[id] : found.levels;
    }
    kmp_free(times);
    kmp_free(level);
    kmp_free(is_output);
    return found;
}

/* Steps of single operations, as array languages are written (exchange/code/vectorised.h). */
static int count_levels(const kempe_model *model)
{
    const kempe_generate_options g = {.sets = "M_C", .scheme = "ner", .keep_parameters = 1, .vectorised = 1};
    kmp_code_source source;
    kmp_nesting_levels levels;
    if (kmp_source_init(&source, model, &g) != KEMPE_OK || !kmp_levels_init(&levels, &source, &source.routines[0]))
        stop("not written:");
    int found = levels.steps;
    kmp_levels_free(&levels);
    kmp_source_free(&source);
    return found;
}

static unsigned motion_sets(void)
{
    return kmp_sets_find("M_C", 3);
}

static long shared_values(const scheme *s)
{
    const kmp_ref *out = s->out;
    kmp_program *p = kmp_program_new(s->eq.graph, 1, &s->count, &out);
    if (!p)
        stop("no memory");
    long found = kmp_program_steps(p).serial;
    kmp_program_free(p);
    return found;
}

/* M and C by themselves, as the scheme has them: no equation of one is an equation of the other. */
static steps steps_apart(const kempe_model *model)
{
    steps sum = {0};
    for (int k = 0; k < 2; k++) {
        scheme s;
        scheme_init(&s, model, kmp_sets_find(k ? "C" : "M", 1), false);
        steps one = count_steps(&s);
        sum.assignments += one.assignments;
        sum.outputs += one.outputs;
        sum.shared += shared_values(&s);
        sum.trig = one.trig > sum.trig ? one.trig : sum.trig;
        sum.levels = one.levels > sum.levels ? one.levels : sum.levels;
        scheme_free(&s);
    }
    return sum;
}

static void put_steps(const char *what, const kempe_model *model)
{
    kmp_tally tally;
    const kmp_derivation_request scene = {.scheme = KMP_SCHEME_NER, .keep = KMP_KEEP_NUMBERS};
    steps plain = steps_apart(model);
    if (kmp_tally_sets(model, &scene, motion_sets(), &tally) != KEMPE_OK)
        stop("not counted:");
    printf("  %-46s %6ld %6ld %6ld %6ld %6ld | %6ld %6ld %6d\n", what, plain.assignments - plain.outputs + plain.trig,
           plain.outputs, plain.trig, plain.shared - plain.outputs + plain.trig, plain.levels, tally.steps.serial,
           tally.steps.vector, count_levels(model));
}

static kempe_model *read_text(const char *text)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text(context, text, "text", &model) != KEMPE_OK)
        stop("not read:");
    return model;
}

/* Nine bodies one behind the other, about x and y alternately. */
static kempe_model *chain(const char *offset, const char *com)
{
    kmp_text t = {0};
    kmp_text_put(&t, "kempe: 1\nname: chain\ngravity: [0, 0, -9.81]\nbodies:\n");
    for (int k = 1; k <= 9; k++) {
        kmp_text_printf(&t, "  b%d: {joint: {motions: [R%d], at: ", k, k % 2 ? 1 : 2);
        kmp_text_printf(&t, k > 1 ? "b%d.P}" : "ground}", k - 1);
        kmp_text_printf(&t, ", mass: 1.%d, com: %s, inertia: {xx: 0.2%d, yy: 0.3%d, zz: 0.3%d}, points: {P: %s}}\n", k,
                        com, k, k, k + 10, offset);
    }
    kempe_model *model = read_text(t.s);
    kmp_text_free(&t);
    return model;
}

static void put_head(const char *of)
{
    printf("M and C of %s\n", of);
    printf("  %-46s %34s | %s\n", "", "the scheme as it is", "with all simplifications");
    printf("  %-46s %6s %6s %6s %6s %6s | %6s %6s %6s\n", "", "steps", "+ out", "trig", "shared", "VSI", "steps", "VSI",
           "by ops");
}

static void put_file(const char *what, const char *path)
{
    kempe_model *model = NULL;
    if (kempe_model_read(context, path, &model) != KEMPE_OK)
        stop("not read:");
    put_steps(what, model);
    kempe_model_free(model);
}

static void all_steps(void)
{
    static const char *const variants[][3] = {
        {"chain of 9 bodies, offset z, centre xyz", "[0, 0, 0.7]", "[0.1, 0.2, 0.3]"},
        {"chain of 9 bodies, offset z, centre xz", "[0, 0, 0.7]", "[0.1, 0, 0.3]"},
        {"chain of 9 bodies, offset xz, centre z", "[0.4, 0, 0.7]", "[0, 0, 0.3]"},
        {"chain of 9 bodies, offset xz, centre xz", "[0.4, 0, 0.7]", "[0.1, 0, 0.3]"},
        {"chain of 9 bodies, offset z, centre z", "[0, 0, 0.7]", "[0, 0, 0.3]"},
        {"chain of 9 bodies, offset xyz, centre xyz", "[0.4, 0.5, 0.7]", "[0.1, 0.2, 0.3]"}};
    put_head("a pendulum of 9 degrees of freedom in space; the paper: 560 serial steps, 18 vector steps");
    put_file("three bodies on R1 R2 R3, offset and centre z", "tests/models/pendulum9.yaml");
    for (size_t k = 0; k < sizeof variants / sizeof *variants; k++) {
        kempe_model *model = chain(variants[k][1], variants[k][2]);
        put_steps(variants[k][0], model);
        kempe_model_free(model);
    }
    printf("\n");
    put_head("a bogie; the paper: 1448 serial steps, 23 vector steps, of a bogie of 22 degrees of freedom");
    put_file("examples/bogie, 24 coordinates", "examples/bogie/bogie.yaml");
    printf("  steps: equations with a name and sines and cosines, as many as trig says; + out: entries of M and C;\n"
           "  shared: like steps, if any shared value had a name; with all simplifications: what\n"
           "  `kempe generate --count` says (any shared value is an assignment, outputs are, sines and cosines are\n"
           "  not); by ops: steps of single operations, as array languages are written\n\n");
}

/* -- useless equations ------------------------------------------------------------------------------- */

enum { SETS = 2 };

typedef struct logged {
    const char *file;
    int removed[SETS]; /* per cent, 0: unknown */
} logged;

static const char *const set_names[SETS] = {"M_C", "invdyn"};

/* Equations made, with a name, and operations made; and those that no entry needs. */
static void put_useless(const kempe_model *model, const char *name, int set, int of_robotran)
{
    scheme s;
    long made = 0, needed = 0, operations = 0, needed_operations = 0;
    scheme_init(&s, model, kmp_sets_find(set_names[set], strlen(set_names[set])), true);
    const kmp_graph *g = s.eq.graph;
    for (uint32_t id = 0; id < kmp_graph_count(g); id++) {
        const kmp_node *n = kmp_graph_node(g, id);
        if (!moves(n))
            continue;
        made += kmp_graph_label_of(g, id) != NULL;
        needed += kmp_graph_label_of(g, id) && s.live[id];
        operations += is_operation(n);
        needed_operations += is_operation(n) && s.live[id];
    }
    printf("  %-12s %-7s |", name, set_names[set]);
    printf(" %6ld of %6ld %5.1f %% |", made - needed, made, 100 * (double)(made - needed) / (double)made);
    printf(" %6ld of %6ld %5.1f %% |", operations - needed_operations, operations,
           100 * (double)(operations - needed_operations) / (double)operations);
    if (of_robotran)
        printf(" %d %%", of_robotran);
    printf("\n");
    scheme_free(&s);
}

static void all_useless(void)
{
    static const logged models[] = {{"andrews", {0}},    {"stewart", {0}},    {"pendulum9", {0}},
                                    {"bogie", {0}},      {"car44", {43, 59}}, {"roadster52", {0}},
                                    {"humanoid29", {0}}, {"limousine63", {0}}};
    static const char *const paths[] = {"examples/andrews/andrews.yaml", "examples/stewart/stewart.yaml",
                                        "tests/models/pendulum9.yaml", "examples/bogie/bogie.yaml"};
    enum { OWN = sizeof paths / sizeof *paths };
    const char *folder = getenv("KEMPE_MBS");
    (void)kempe_context_set_left_out(context, "extforce, link"); /* laws of user code are not counted */
    printf("equations and operations that no output needs; the paper: up to 30 %% of the operations\n"
           "(with forces and torques on the bodies as inputs, as ROBOTRAN has them)\n");
    printf("  %-20s | %24s | %24s | %s\n", "", "named equations", "operations", "ROBOTRAN's log, equations");
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        char path[1024];
        kempe_model *model = NULL;
        if (k < OWN)
            snprintf(path, sizeof path, "%s", paths[k]);
        else
            snprintf(path, sizeof path, "%s/%s.mbs", folder ? folder : ".", models[k].file);
        if (k >= OWN && !folder)
            continue;
        if (kempe_model_read(context, path, &model) != KEMPE_OK)
            stop("not read:");
        for (int set = 0; set < SETS; set++)
            put_useless(model, models[k].file, set, models[k].removed[set]);
        kempe_model_free(model);
    }
}

int bench_paper(int argc, char **argv)
{
    (void)argc, (void)argv;
    context = kempe_context_new();
    if (!context)
        return 1;
    all_steps();
    all_useless();
    kempe_context_free(context);
    return 0;
}
