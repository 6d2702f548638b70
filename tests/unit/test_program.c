/* SPDX-License-Identifier: BSD-3-Clause */
/* Programs: what is scheduled, and in which stage; the tape against a plain reading of the program, to the last bit. */
#include "backend/encoders.h"
#include "backend/machine.h"
#include "base/memory.h"
#include "plain.h"
#include "platform/platform.h"
#include "random_graph.h"
#include "symbolic/function_table.h"
#include "symbolic/program.h"
#include "testing.h"

#if defined(__linux__) && defined(__GLIBC__)
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

/* -- back ends against a plain evaluation --------------------------------------------------------------- */

static bool same_bits(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static void set_inputs(kmp_machine *machine, const double *const inputs[KMP_IN_COUNT])
{
    for (int kind = 0; kind < KMP_IN_COUNT; kind++)
        if (inputs[kind])
            kmp_machine_set(machine, (kmp_input_kind)kind, inputs[kind]);
}

static int mismatches(const kmp_program *p, kmp_machine *machine, plain *a, const double *const inputs[KMP_IN_COUNT])
{
    int bad = 0;
    set_inputs(machine, inputs);
    for (int s = 0; s < p->stages; s++) {
        const double *tape = kmp_machine_run(machine, s), *expected = plain_run(a, inputs, s);
        for (int k = 0; k < p->outputs[s + 1] - p->outputs[s]; k++)
            bad += !same_bits(tape[k], expected[k]);
    }
    return bad;
}

/* Outputs that differ in any bit. A first run with inputs that are no numbers leaves NaN in every slot that depends on
 * them: what a second run forgets to compute shows. */
static int mismatches_of(const char *backend, const kmp_program *p, const double *const inputs[KMP_IN_COUNT])
{
    double nans[64];
    const double *none[KMP_IN_COUNT];
    for (int k = 0; k < 64; k++)
        nans[k] = NAN;
    for (int k = 0; k < KMP_IN_COUNT; k++)
        none[k] = nans;
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find(backend));
    plain a = plain_new(p);
    int bad = mismatches(p, machine, &a, none) + mismatches(p, machine, &a, inputs);
    bad += mismatches(p, machine, &a, inputs);
    plain_free(&a);
    kmp_machine_free(machine);
    return bad;
}

static int backend_mismatches(const kmp_program *p, const double *const inputs[KMP_IN_COUNT])
{
    return mismatches_of("tape", p, inputs) + mismatches_of("native", p, inputs);
}

static void test_backends(void)
{
    CHECK(kmp_backend_find("tape") != NULL && kmp_backend_find("abacus") == NULL);
}

#if defined(__linux__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__clang__)
/* If the system gives no pages for code, the tape runs the program under the other name. The test is in a child
 * process, which reserves memory and then may not map any more. */
static void test_no_pages(void)
{
    fflush(stdout);
    pid_t child = fork();
    if (child == 0) {
        const double x[] = {0.3, -0.7}, *inputs[KMP_IN_COUNT] = {[KMP_IN_Q] = x};
        kmp_graph *g = kmp_graph_new();
        kmp_ref a = kmp_input(g, KMP_IN_Q, 0), b = kmp_input(g, KMP_IN_Q, 1);
        kmp_ref out[] = {kmp_mul(g, kmp_add(g, a, b), kmp_sin(g, b)), kmp_div(g, a, b)}, *group = out;
        kmp_program *p = kmp_program_new(g, 1, &(int){2}, (const kmp_ref *const *)&group);
        mallopt(M_MMAP_MAX, 0);
        mallopt(M_TRIM_THRESHOLD, 1 << 30);
        kmp_free(kmp_calloc(1 << 20, 1));
        bool set = setrlimit(RLIMIT_AS, &(struct rlimit){1, 1}) == 0;
        if (mmap(NULL, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED)
            _exit(2);
        _exit(set && !kmp_pages_new("x", 1) && mismatches_of("native", p, inputs) == 0 ? 0 : 1);
    }
    int status = 1;
    CHECK(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 2);
    if (WEXITSTATUS(status) == 2)
        printf("skipped: memory is not limited here\n"); /* QEMU does not */
}
#else
static void test_no_pages(void)
{
    printf("skipped: memory cannot be limited here\n");
}
#endif

/* The change of the values of all steps when the inputs change. */
static void sensitivities(const steps *s, const double *x, double *size)
{
    double moved[GRAPH_INPUTS], v[GRAPH_STEPS], w[GRAPH_STEPS];
    steps_eval(s, x, v);
    for (int k = 0; k < s->count; k++)
        size[k] = 1 + fabs(v[k]);
    for (int i = 0; i < GRAPH_INPUTS; i++) {
        memcpy(moved, x, sizeof moved);
        moved[i] += 1e-6;
        steps_eval(s, moved, w);
        for (int k = 0; k < s->count; k++)
            size[k] += fabs(w[k] - v[k]) * 1e6;
    }
}

/* Steps as outputs of two groups, every third with the other sign: all, or one of some, so that others have a single
 * reader. */
static void random_program(uint64_t seed)
{
    int apart = seed % 2 ? 1 : 5;
    double x[GRAPH_INPUTS], size[GRAPH_STEPS];
    steps s;
    kmp_ref r[GRAPH_STEPS];
    random_seed(seed);
    for (int k = 0; k < GRAPH_INPUTS; k++)
        x[k] = between(-1.5, 1.5);
    random_steps(&s, 10 + pick(GRAPH_STEPS - 10), x);
    sensitivities(&s, x, size);
    kmp_graph *g = kmp_graph_new();
    steps_build(&s, g, r);
    int outputs = 0;
    for (int k = apart - 1; k < s.count; k += apart, outputs++) {
        r[outputs] = outputs % 3 == 0 ? kmp_neg(r[k]) : r[k];
        size[outputs] = size[k];
    }
    int first = pick(outputs), count[2] = {first, outputs - first};
    const kmp_ref *group[2] = {r, r + first};
    kmp_program *p = kmp_program_new(g, 2, count, group);
    const double *const inputs[KMP_IN_COUNT] = {[KMP_IN_Q] = x};
    if (seed % 4 > 1)
        CHECK(kmp_program_contract(p, 0, pick(outputs)));
    CHECK(backend_mismatches(p, inputs) == 0);
    double *value = KMP_NEW(double, kmp_graph_count(g));
    kmp_graph_eval(g, inputs, value);
    plain a = plain_new(p);
    for (int stage = 0; stage < p->stages; stage++)
        (void)plain_run(&a, inputs, stage);
    for (int k = 0; k < outputs; k++)
        CHECK_NEAR(a.out[k], value_of(value, r[k]), 1e-12 * size[k]);
    plain_free(&a);
    kmp_free(value);
    kmp_program_free(p);
    kmp_graph_free(g);
}

static void test_random_programs(void)
{
    for (uint64_t seed = 1; seed <= 300; seed++)
        random_program(seed);
}

/* -- forms that the tape treats apart ------------------------------------------------------------------ */

typedef struct scene {
    kmp_graph *g;
    kmp_ref q[6], c, p;
} scene;

static scene new_scene(void)
{
    scene s = {.g = kmp_graph_new()};
    for (uint32_t k = 0; k < 6; k++)
        s.q[k] = kmp_input(s.g, KMP_IN_Q, k);
    s.c = kmp_const(s.g, 0.1);
    s.p = kmp_input(s.g, KMP_IN_PARAMETER, 0);
    return s;
}

static const double scene_q[6] = {0.7, -1.3, 2.9, 1e-3, -0.4, 1.7}, scene_p[1] = {3.3};
static const double *const scene_inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = scene_p, [KMP_IN_Q] = scene_q};

static kmp_program *one_group(kmp_graph *g, int count, const kmp_ref *outputs)
{
    return kmp_program_new(g, 1, &count, &outputs);
}

static void test_fusing(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref xy = kmp_mul(g, s.q[0], s.q[1]), cx = kmp_mul(g, s.c, s.q[2]), zw = kmp_mul(g, s.q[3], s.q[4]);
    kmp_ref shared = kmp_mul(g, s.q[1], s.q[2]), deep = kmp_mul(g, s.c, kmp_sin(g, s.q[5]));
    kmp_ref out[] = {kmp_add(g, xy, s.q[5]),                         /* product first */
                     kmp_sub(g, s.q[5], zw),                         /* subtracted product without a number */
                     kmp_sub(g, s.q[5], cx),                         /* and with one */
                     kmp_sub(g, kmp_mul(g, s.q[0], s.q[2]), s.q[5]), /* a product less a value */
                     kmp_add(g, kmp_mul(g, s.q[0], s.q[3]), deep),   /* products of different depths */
                     kmp_add(g, shared, s.q[0]),                     /* a product with two readers */
                     kmp_add(g, shared, s.q[3]),
                     kmp_sub(g, s.q[4], kmp_mul(g, s.c, kmp_neg(s.q[1]))), /* signs that cancel */
                     kmp_neg(kmp_sub(g, kmp_mul(g, s.c, s.q[1]), s.q[3])), /* a negative output */
                     kmp_sub(g, kmp_mul(g, s.c, s.q[0]), kmp_mul(g, kmp_const(g, 0.2), s.q[1])),
                     kmp_neg(cx),
                     zw,
                     s.q[2],
                     kmp_neg(s.q[2]),
                     s.c,
                     kmp_neg(s.c),
                     KMP_ZERO,
                     s.p,
                     kmp_neg(s.p)};
    kmp_program *p = one_group(g, (int)(sizeof out / sizeof *out), out);
    CHECK(backend_mismatches(p, scene_inputs) == 0);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* Signed zeros, infinities, numbers that are none. */
static void test_corners(void)
{
    static const double corners[] = {0.0, -0.0, 1.0, -1.0, INFINITY, -INFINITY, NAN, 5e-324, 1e308};
    enum { CORNERS = sizeof corners / sizeof *corners };
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref x = s.q[0], y = s.q[1], z = s.q[2];
    kmp_ref out[] = {kmp_add(g, x, y),
                     kmp_sub(g, x, y),
                     kmp_sub(g, y, x),
                     kmp_neg(kmp_add(g, x, y)),
                     kmp_mul(g, x, y),
                     kmp_div(g, x, y),
                     kmp_add(g, x, kmp_mul(g, y, z)),
                     kmp_sub(g, x, kmp_mul(g, s.c, y)),
                     kmp_sub(g, kmp_mul(g, s.c, x), y),
                     kmp_sqrt(g, x),
                     kmp_sqrt(g, kmp_neg(x)),
                     kmp_unary(g, KMP_OP_EXP, kmp_neg(x)),
                     kmp_unary(g, KMP_OP_LOG, x),
                     kmp_sin(g, x),
                     kmp_cos(g, kmp_mul(g, x, y)),
                     kmp_select(g, kmp_less(g, x, y), kmp_neg(z), kmp_sqrt(g, y)),
                     kmp_select(g, x, KMP_ZERO, kmp_neg(y)),
                     kmp_unary(g, KMP_OP_ABS, x),
                     kmp_unary(g, KMP_OP_SIGN, x),
                     kmp_binary(g, KMP_OP_MIN, x, kmp_neg(y)),
                     kmp_binary(g, KMP_OP_MAX, x, y),
                     kmp_binary(g, KMP_OP_POW, x, y),
                     kmp_binary(g, KMP_OP_ATAN2, kmp_neg(x), y)};
    kmp_program *p = one_group(g, (int)(sizeof out / sizeof *out), out);
    int bad = 0;
    for (int i = 0; i < CORNERS * CORNERS * CORNERS; i++) {
        double q[6] = {corners[i % CORNERS], corners[i / CORNERS % CORNERS], corners[i / CORNERS / CORNERS]};
        const double *const inputs[KMP_IN_COUNT] = {[KMP_IN_PARAMETER] = scene_p, [KMP_IN_Q] = q};
        bad += backend_mismatches(p, inputs);
    }
    CHECK(bad == 0);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* More than 65535 slots: the wide records. */
static void test_wide_program(void)
{
    enum { LENGTH = 30000 };
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref sum = s.q[0], out[3];
    random_seed(7);
    for (int k = 0; k < LENGTH; k++) {
        kmp_ref scaled = kmp_mul(g, kmp_const(g, between(-0.9, 0.9)), sum), q = s.q[1 + k % 5];
        sum = k % 2 ? kmp_add(g, q, scaled) : kmp_sub(g, q, scaled);
        if (k % 1000 == 0)
            sum = kmp_add(g, kmp_sin(g, sum), kmp_div(g, sum, kmp_add(g, kmp_const(g, 2), kmp_mul(g, sum, sum))));
        if (k == LENGTH / 2)
            out[2] = kmp_neg(sum);
    }
    out[0] = sum;
    out[1] = kmp_cos(g, sum);
    kmp_program *p = one_group(g, 3, out);
    CHECK(p->code[p->stages] + p->constant_count > 65536);
    CHECK(backend_mismatches(p, scene_inputs) == 0);
    double *value = KMP_NEW(double, kmp_graph_count(g));
    kmp_graph_eval(g, scene_inputs, value);
    plain a = plain_new(p);
    (void)plain_run(&a, scene_inputs, 1);
    for (int k = 0; k < 3; k++)
        CHECK(same_bits(a.out[k], value_of(value, out[k])));
    plain_free(&a);
    kmp_free(value);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* -- stages -------------------------------------------------------------------------------------------- */

static int stage_length(const kmp_program *p, int stage)
{
    return p->code[stage + 1] - p->code[stage];
}

static void test_parameter_stage(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref pp = kmp_mul(g, s.p, s.p), out[2] = {kmp_mul(g, kmp_sqrt(g, pp), s.q[0]), kmp_add(g, pp, s.c)};
    kmp_program *p = one_group(g, 2, out);
    CHECK(p->stages == 2 && stage_length(p, 0) == 3 && stage_length(p, 1) == 1); /* p p, sqrt, +; the product */
    CHECK(backend_mismatches(p, scene_inputs) == 0);
    kmp_program_free(p);
    kmp_graph_free(g);
}

static void test_shared_values(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref shared = kmp_add(g, s.q[0], s.q[1]), early = kmp_mul(g, shared, s.q[2]);
    kmp_ref late[2] = {kmp_mul(g, shared, s.q[3]), early}, none = KMP_ZERO;
    (void)kmp_div(g, shared, s.q[5]); /* nobody asks for it */
    const kmp_ref *group[3] = {&early, &none, late};
    int count[3] = {1, 0, 2};
    kmp_program *p = kmp_program_new(g, 3, count, group);
    CHECK(stage_length(p, 0) == 0 && stage_length(p, 1) == 2 && stage_length(p, 2) == 0 && stage_length(p, 3) == 1);
    CHECK(p->input_count == 4 && p->constant_count == 0);
    CHECK(p->outputs[1] == 0 && p->outputs[2] == 1 && p->outputs[3] == 1 && p->outputs[4] == 3);
    CHECK(p->output[0] == p->output[2] && p->graph_nodes >= 10);
    kmp_counts c = kmp_program_count(p, 1, 3), first = kmp_program_count(p, 1, 1);
    CHECK(c.add == 1 && c.mul == 2 && c.div == 0 && c.trig == 0 && c.paper == 3 && first.paper == 2);
    CHECK(backend_mismatches(p, scene_inputs) == 0);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* A stage may be run again and again with only its own inputs changed. */
static void test_stages_apart(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref rate = kmp_input(g, KMP_IN_QD, 0), sum = kmp_sin(g, kmp_add(g, s.q[0], s.q[1]));
    kmp_ref late = kmp_mul(g, kmp_add(g, sum, s.c), rate);
    const kmp_ref *group[2] = {&sum, &late};
    int count[2] = {1, 1};
    double qd[1] = {2}, q[2] = {0.25, 0.5};
    kmp_program *p = kmp_program_new(g, 2, count, group);
    kmp_machine *machine = kmp_machine_new(p, kmp_backend_find("tape"));
    kmp_machine_set(machine, KMP_IN_Q, q);
    (void)kmp_machine_run(machine, 0);
    double first = *kmp_machine_run(machine, 1);
    CHECK_NEAR(first, sin(0.75), 1e-15);
    for (; qd[0] < 5; qd[0]++) {
        kmp_machine_set(machine, KMP_IN_QD, qd);
        CHECK_NEAR(*kmp_machine_run(machine, 2), (first + 0.1) * qd[0], 1e-15);
    }
    kmp_machine_free(machine);
    kmp_program_free(p);
    kmp_graph_free(g);
}

/* -- sums of angles ------------------------------------------------------------------------------------ */

static long trig_of(kmp_graph *g, int count, const kmp_ref *out)
{
    kmp_program *p = one_group(g, count, out);
    long trig = kmp_program_count(p, 0, 1).trig;
    CHECK(backend_mismatches(p, scene_inputs) == 0);
    plain a = plain_new(p);
    double *value = KMP_NEW(double, kmp_graph_count(g));
    kmp_graph_eval(g, scene_inputs, value);
    (void)plain_run(&a, scene_inputs, 0);
    (void)plain_run(&a, scene_inputs, 1);
    for (int k = 0; k < count; k++)
        CHECK_NEAR(a.out[k], value_of(value, out[k]), 1e-14);
    kmp_free(value);
    plain_free(&a);
    kmp_program_free(p);
    return trig;
}

static void test_addition_theorem(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref ab = kmp_add(g, s.q[0], s.q[1]), abc = kmp_add(g, ab, s.q[2]), less = kmp_sub(g, s.q[0], s.q[1]);
    kmp_ref alone[2] = {kmp_sin(g, ab), kmp_cos(g, ab)};
    CHECK(trig_of(g, 2, alone) == 2);
    kmp_ref half[3] = {kmp_sin(g, ab), kmp_cos(g, ab), kmp_sin(g, s.q[0])}; /* b is needed nowhere else */
    CHECK(trig_of(g, 3, half) == 3);
    kmp_ref both[4] = {kmp_sin(g, ab), kmp_cos(g, ab), kmp_sin(g, s.q[0]), kmp_cos(g, s.q[1])};
    CHECK(trig_of(g, 4, both) == 4); /* sin and cos of a and of b */
    kmp_ref chain[4] = {kmp_sin(g, abc), kmp_cos(g, ab), kmp_sin(g, s.q[0]), kmp_cos(g, s.q[2])};
    CHECK(trig_of(g, 4, chain) == 5); /* b is not live: sin and cos of a + b and of c, sin a */
    kmp_ref full[5] = {kmp_sin(g, abc), kmp_cos(g, ab), kmp_sin(g, s.q[0]), kmp_sin(g, s.q[1]), kmp_cos(g, s.q[2])};
    CHECK(trig_of(g, 5, full) == 6);
    kmp_ref minus[4] = {kmp_sin(g, kmp_neg(less)), kmp_cos(g, less), kmp_sin(g, s.q[0]), kmp_cos(g, s.q[1])};
    CHECK(trig_of(g, 4, minus) == 4);
    kmp_ref constant[3] = {kmp_sin(g, kmp_add(g, s.c, s.q[0])), kmp_sin(g, s.q[0]), kmp_cos(g, s.q[0])};
    CHECK(trig_of(g, 3, constant) == 2); /* a number is at hand */
    kmp_graph_free(g);
}

/* Functions inside arguments of functions. */
static void test_nested_angles(void)
{
    scene s = new_scene();
    kmp_graph *g = s.g;
    kmp_ref ab = kmp_add(g, s.q[0], s.q[1]), inner = kmp_sin(g, ab), outer = kmp_add(g, inner, s.q[0]);
    kmp_ref out[] = {kmp_cos(g, outer), kmp_sin(g, s.q[0]), kmp_cos(g, s.q[1]), kmp_cos(g, inner), kmp_sqrt(g, outer)};
    (void)trig_of(g, 5, out);
    kmp_graph_free(g);
}

int main(void)
{
    TEST(test_backends);
    TEST(test_no_pages);
    TEST(test_random_programs);
    TEST(test_fusing);
    TEST(test_corners);
    TEST(test_wide_program);
    TEST(test_parameter_stage);
    TEST(test_shared_values);
    TEST(test_stages_apart);
    TEST(test_addition_theorem);
    TEST(test_nested_angles);
    return check_report();
}
