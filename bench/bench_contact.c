/* SPDX-License-Identifier: BSD-3-Clause */
/* Cost of the contact of one wheel: operations and microseconds of one evaluation of h, J, M, C and jdqd of a wheel
 * on its carrier (x, y, z, yaw, roll, spin), by the tape and by machine code, over poses of a motion that follow each
 * other; and what each part of the contact adds to that: the carrier alone, geometry, Hertz's stiffness, the law of
 * creep. An operation is + - * / or a function; the local unknown of the contact counts by what its iteration takes in
 * the times alone.
 *
 *     bench contact            the table
 *     bench contact BACKEND CASE TIMES     that case alone so many times, for callgrind */
#include "backend/machine.h"
#include "bench.h"
#include <math.h>
#include <string.h>

enum { POSES = 256, SAMPLES = 11, COORDINATES = 6, STAGES = 4 };

typedef struct scene {
    const char *name, *wheel;
    int before; /* the case that it adds to; -1: none */
} scene;

/* The first one has no wheel. */
static const scene scenes[] = {
    {"carrier alone", NULL, -1},
    {"elastic, stiffness given, no creep", "contact: elastic, creep: none, stiffness: 1e11", 0},
    {"elastic, Hertz, no creep", "contact: elastic, creep: none", 1},
    {"elastic, linear", "contact: elastic, creep: linear", 2},
    {"elastic, shen", "contact: elastic, creep: shen", 2},
    {"elastic, polach", "contact: elastic, creep: polach", 2},
    {"elastic, tanh", "contact: elastic, creep: tanh", 2},
    {"rigid, no creep", "contact: rigid, creep: none", 0},
    {"rigid, linear", "contact: rigid, creep: linear", 7},
    {"rigid, shen", "contact: rigid, creep: shen", 7},
    {"rigid, polach", "contact: rigid, creep: polach", 7},
    {"rigid, tanh", "contact: rigid, creep: tanh", 7},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static const char text[] =
    "kempe: 1\n"
    "profiles:\n"
    "  wheel: {csv: examples/profiles/s1002.csv, y: y, z: z}\n"
    "  head: {csv: examples/profiles/uic60.csv, y: y, z: z}\n"
    "tracks:\n"
    "  line: {at: ground.O, rail: head, gauge: 1435 mm, inclination: 1/40%s}\n"
    "ground: {points: {O: [0, 0, 0]}}\n"
    "bodies:\n"
    "  carrier: {joint: {motions: [T1, T2, T3, R3, R1], at: ground.O}, mass: 500, inertia: {xx: 200, yy: 10, zz: "
    "200}}\n"
    "  wheel: {joint: {revolute: y, at: carrier}, mass: 400, inertia: {xx: 20, yy: 40, zz: 20}, points: {C: [0, 0.75, "
    "0]}}\n";

static bench load(const scene *s, bool curved)
{
    char all[4096];
    bench b = {kempe_context_new(), NULL, NULL};
    int used = snprintf(all, sizeof all, text,
                        curved ? ", course: [{straight: 10}, {transition: 20}, {left: 200, radius: 150, cant: 80 mm}, "
                                 "{transition: 20}, {straight: 5}]"
                               : "");
    if (s->wheel)
        (void)snprintf(all + used, sizeof all - (size_t)used,
                       "wheels: {L: {on: line.left, at: wheel.C, profile: wheel, radius: 0.46, %s}}\n", s->wheel);
    if (kempe_model_read_text(b.context, all, "contact.yaml", &b.model) || kempe_system_new(b.model, &b.system)) {
        fprintf(stderr, "%s: %s\n", s->name, kempe_context_message(b.context));
        exit(1);
    }
    return b;
}

/* -- one evaluation ---------------------------------------------------------------------------------- */

static double pose_q[POSES][COORDINATES], pose_qd[POSES][COORDINATES];

/* A wheel that goes on at 20 m/s, swings by millimetres and presses by tenths of them. */
static void make_poses(bool curved)
{
    for (int k = 0; k < POSES; k++) {
        double a = 2 * 3.14159265358979 * k / POSES, along = curved ? 5 : 0;
        double q[COORDINATES] = {along + 0.02 * k, 0.003 * sin(a), 0.4598 + 1e-5 * cos(2 * a),
                                 0.002 * cos(a),   0.001 * sin(a), 0.02 * k / 0.46};
        double qd[COORDINATES] = {20, 0.02 * cos(a), -1e-4 * sin(a), -0.01 * sin(a), 0.005 * cos(a), 20 / 0.46};
        memcpy(pose_q[k], q, sizeof q);
        memcpy(pose_qd[k], qd, sizeof qd);
    }
}

static void evaluate(kmp_machine *machine, int pose, int last)
{
    const double lambda[1] = {5e4};
    kmp_machine_set(machine, KMP_IN_Q, pose_q[pose % POSES]);
    kmp_machine_set(machine, KMP_IN_QD, pose_qd[pose % POSES]);
    kmp_machine_set(machine, KMP_IN_LAMBDA, lambda);
    for (int stage = KMP_STAGE_CLOSURE; stage <= last; stage++)
        (void)kmp_machine_run(machine, stage);
}

static kmp_machine *machine_of(const bench *b, const char *backend)
{
    const double zero = 0, on[64] = {[0] = 1, [1] = 1, [2] = 1, [3] = 1};
    kmp_machine *machine = kmp_machine_new(b->system->motion, kmp_backend_find(backend));
    if (!machine)
        exit(1);
    kmp_machine_set(machine, KMP_IN_PARAMETER, b->system->parameters);
    kmp_machine_set(machine, KMP_IN_TIME, &zero);
    if (b->system->events.count > 0)
        kmp_machine_set(machine, KMP_IN_MODE, on);
    (void)kmp_machine_run(machine, KMP_STAGE_PARAMETERS);
    return machine;
}

/* Seconds of one, the median of samples. */
static double time_of(const bench *b, const char *backend)
{
    double sample[SAMPLES];
    kmp_machine *machine = machine_of(b, backend);
    int last = KMP_STAGE_BIAS;
    for (int s = 0; s < SAMPLES; s++) {
        double from = bench_now();
        for (int k = 0; k < 4 * POSES; k++)
            evaluate(machine, k, last);
        sample[s] = (bench_now() - from) / (4 * POSES);
    }
    kmp_machine_free(machine);
    return bench_median(SAMPLES, sample);
}

/* -- the table ---------------------------------------------------------------------------------------- */

static long operations_of(const kmp_program *program)
{
    kmp_counts c = kmp_program_count(program, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
    return c.paper + c.trig + c.other;
}

static void put_table(bool curved)
{
    double seconds[SCENES][2];
    long operations[SCENES];
    make_poses(curved);
    printf("%s\n%-36s | %6s %7s %7s | %s\n", curved ? "curved, with cant" : "straight", "", "oper.", "tape", "native",
           "adds: oper., us by the tape and natively");
    for (int k = 0; k < SCENES; k++) {
        bench b = load(&scenes[k], curved);
        operations[k] = operations_of(b.system->motion);
        seconds[k][0] = time_of(&b, "tape");
        seconds[k][1] = time_of(&b, "native");
        printf("%-36s | %6ld %7.2f %7.2f |", scenes[k].name, operations[k], 1e6 * seconds[k][0], 1e6 * seconds[k][1]);
        if (scenes[k].before >= 0)
            printf(" %6ld %7.2f %7.2f to '%s'", operations[k] - operations[scenes[k].before],
                   1e6 * (seconds[k][0] - seconds[scenes[k].before][0]),
                   1e6 * (seconds[k][1] - seconds[scenes[k].before][1]), scenes[scenes[k].before].name);
        printf("\n");
        bench_free(&b);
    }
}

int bench_contact(int argc, char **argv)
{
    if (argc == 4) {
        bench b = load(&scenes[atoi(argv[2]) % SCENES], false);
        make_poses(false);
        kmp_machine *machine = machine_of(&b, argv[1]);
        for (int k = 0; k < atoi(argv[3]); k++)
            evaluate(machine, k, KMP_STAGE_BIAS);
        kmp_machine_free(machine);
        bench_free(&b);
        return 0;
    }
    put_table(false);
    put_table(true);
    return 0;
}
