/* SPDX-License-Identifier: BSD-3-Clause */
/* The laws of rolling contact: what one evaluation costs, as an expression with and without derivatives and as a
 * function of numbers, and how far each is from FASTSIM with many strips.
 *
 *     bench laws         both tables
 *     bench laws csv     curves of force over creep and over spin, for bench/draw_laws.py */
#include "backend/machine.h"
#include "bench.h"
#include "rail/wheel/laws.h"
#include "symbolic/derivative.h"
#include <kempe/rolling_contact.h>
#include <math.h>
#include <string.h>

/* Coordinates stand for what changes with the state, parameters for the rest. */
enum { ALONG, ACROSS, NORMAL, SLIP_X, SLIP_Y, SPIN, STATE };
enum { SHEAR, FRICTION };
enum { OUTPUTS = 3, SAMPLES = 9 };

static const double parameters[] = {82e9, 0.3}, state[STATE] = {2.17, 1.1, 6e4, 6e-4, -4e-4, 0.1};

/* -- cost ------------------------------------------------------------------------------------------ */

static kmp_program *program_of(kmp_creep_law law, int with_derivatives)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref in[STATE], out[OUTPUTS * (1 + STATE)];
    for (uint32_t k = 0; k < STATE; k++)
        in[k] = kmp_input(g, KMP_IN_Q, k);
    kmp_touch touch = {in[ALONG], in[ACROSS], kmp_input(g, KMP_IN_PARAMETER, SHEAR), 0.28};
    kmp_creep creep = {touch, in[NORMAL], kmp_input(g, KMP_IN_PARAMETER, FRICTION), {in[SLIP_X], in[SLIP_Y]}, in[SPIN]};
    kmp_creep_force f;
    kmp_creep_law_force(g, law, &creep, &f);
    out[0] = f.force[0], out[1] = f.force[1], out[2] = f.moment;
    int count = OUTPUTS;
    for (int k = 0; with_derivatives && k < STATE; k++) {
        kmp_ref one = KMP_ONE;
        kmp_derivative *d = kmp_derivative_new(g, 1, &in[k], &one);
        for (int i = 0; i < OUTPUTS; i++)
            out[count++] = kmp_derivative_of(d, out[i]);
        kmp_derivative_free(d);
    }
    const kmp_ref *outputs = out;
    kmp_program *p = kmp_program_new(g, 1, &count, &outputs);
    kmp_graph_free(g);
    return p;
}

static double time_of_program(const kmp_program *p, const char *backend)
{
    kmp_machine *m = kmp_machine_new(p, kmp_backend_find(backend));
    double sample[SAMPLES];
    enum { TIMES = 20000 };
    kmp_machine_set(m, KMP_IN_PARAMETER, parameters);
    (void)kmp_machine_run(m, 0);
    for (int k = 0; k < SAMPLES; k++) {
        double at[STATE], from = bench_now();
        memcpy(at, state, sizeof at);
        for (int i = 0; i < TIMES; i++) {
            at[SLIP_X] = 1e-7 * i;
            kmp_machine_set(m, KMP_IN_Q, at);
            (void)kmp_machine_run(m, 1);
        }
        sample[k] = (bench_now() - from) / TIMES;
    }
    kmp_machine_free(m);
    return 1e9 * bench_median(SAMPLES, sample);
}

static kempe_creep creep_of(double x, double y, double spin)
{
    kempe_touch touch = {state[ALONG], state[ACROSS], parameters[SHEAR], 0.28};
    kempe_ellipse e = {0};
    (void)kempe_contact_hertz(&touch, state[NORMAL], &e);
    kempe_creep c = {.a = e.a,
                     .b = e.b,
                     .shear_modulus = parameters[SHEAR],
                     .poisson = 0.28,
                     .normal = state[NORMAL],
                     .friction = parameters[FRICTION],
                     .slip = {x, y},
                     .spin = spin};
    return c;
}

static double time_of_numbers(kempe_creep_law law)
{
    kempe_creep c = creep_of(0, state[SLIP_Y], state[SPIN]);
    double sample[SAMPLES];
    for (int k = 0; k < SAMPLES; k++) {
        int times = law == KEMPE_CREEP_FASTSIM ? 200 : 5000;
        double from = bench_now();
        for (int i = 0; i < times; i++) {
            kempe_creep_force f;
            c.slip[0] = 1e-7 * i;
            (void)kempe_contact_creep(law, &c, &f);
        }
        sample[k] = (bench_now() - from) / times;
    }
    return 1e9 * bench_median(SAMPLES, sample);
}

static void print_costs(void)
{
    printf(
        "One evaluation, Hertz's ellipse and Kalker's coefficients included; derivatives by both curvatures, normal\n"
        "force, both creepages and spin. Operations: + - * / and functions. Medians, ns of processor time.\n\n"
        "%-8s %22s %22s %22s %12s\n",
        "law", "operations", "tape", "native", "numbers");
    printf("%-8s %22s %22s %22s\n", "", "value  derivatives", "value  derivatives", "value  derivatives");
    for (int law = KMP_CREEP_LINEAR; law < KMP_CREEP_LAWS; law++) {
        kmp_program *p[2] = {program_of((kmp_creep_law)law, 0), program_of((kmp_creep_law)law, 1)};
        printf("%-8s", kempe_contact_law_name((kempe_creep_law)law));
        for (int k = 0; k < 2; k++)
            printf(" %10ld", kmp_program_count(p[k], 1, 1).robotran);
        for (int b = 0; b < 2; b++)
            for (int k = 0; k < 2; k++)
                printf(" %10.0f", time_of_program(p[k], b ? "native" : "tape"));
        printf(" %12.0f\n", time_of_numbers((kempe_creep_law)law));
        kmp_program_free(p[0]);
        kmp_program_free(p[1]);
    }
    printf("%-8s %82.0f\n", "fastsim", time_of_numbers(KEMPE_CREEP_FASTSIM));
}

/* -- accuracy -------------------------------------------------------------------------------------- */

enum { DIRECTIONS = 8, SIZES = 12 };

/* Greatest and mean distance of force, over friction times normal force, from FASTSIM with many strips, for creepages
 * of all directions and sizes up to four times what would saturate the linear law. */
static void distance(kempe_creep_law law, int strips, double ratio, double spin, double *greatest, double *mean)
{
    kempe_creep c = creep_of(0, 0, 0);
    double size = sqrt(c.a * c.b), bound = c.friction * c.normal, sum = 0;
    kempe_kalker k = {0};
    c.a = size * sqrt(ratio), c.b = size / sqrt(ratio);
    (void)kempe_contact_kalker(ratio, c.poisson, &k);
    c.spin = spin * bound / (c.shear_modulus * size * size * size * k.c23);
    *greatest = 0;
    for (int n = 0; n < SIZES * DIRECTIONS; n++) {
        double t = 4.0 * (n / DIRECTIONS + 0.5) / SIZES,
               angle = 2 * 3.14159265358979323846 * (n % DIRECTIONS) / DIRECTIONS;
        double unit = t * bound / (c.shear_modulus * size * size);
        kempe_creep_force exact, f;
        c.slip[0] = unit * cos(angle) / k.c11, c.slip[1] = unit * sin(angle) / k.c22;
        c.strips = 200;
        (void)kempe_contact_creep(KEMPE_CREEP_FASTSIM, &c, &exact);
        c.strips = strips;
        (void)kempe_contact_creep(law, &c, &f);
        double miss = hypot(f.force[0] - exact.force[0], f.force[1] - exact.force[1]) / bound;
        *greatest = fmax(*greatest, miss);
        sum += miss / (SIZES * DIRECTIONS);
    }
    *mean = sum;
}

static void print_accuracy(void)
{
    static const double ratio[] = {0.3, 1, 3}, spin[] = {0, 0.5, 2};
    static const struct {
        const char *name;
        kempe_creep_law law;
        int strips;
    } rows[] = {{"linear", KEMPE_CREEP_LINEAR, 0},       {"shen", KEMPE_CREEP_SHEN, 0},
                {"polach", KEMPE_CREEP_POLACH, 0},       {"tanh", KEMPE_CREEP_TANH, 0},
                {"fastsim 10", KEMPE_CREEP_FASTSIM, 10}, {"fastsim 50", KEMPE_CREEP_FASTSIM, 50}};
    printf(
        "\nDistance of the force from FASTSIM with 200 strips, per cent of friction times normal force: greatest and\n"
        "mean, over creepages of all directions and sizes to 4 times what the linear law would saturate at. Spin in\n"
        "the same unit.\n\n%-12s",
        "a/b, spin");
    for (int k = 0; k < 9; k++)
        printf("   %3.1f, %3.1f ", ratio[k / 3], spin[k % 3]);
    printf("\n");
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        printf("%-12s", rows[r].name);
        for (int k = 0; k < 9; k++) {
            double greatest, mean;
            distance(rows[r].law, rows[r].strips, ratio[k / 3], spin[k % 3], &greatest, &mean);
            printf(" %6.1f %4.1f", 100 * greatest, 100 * mean);
        }
        printf("\n");
    }
}

/* -- curves ---------------------------------------------------------------------------------------- */

/* Force along over creep along, and across over spin, over friction times normal force: of the ellipse for which
 * CONTACT has values (tests/unit/test_contact.c). */
static void print_curves(void)
{
    printf("over,at");
    for (int law = KEMPE_CREEP_LINEAR; law <= KEMPE_CREEP_FASTSIM; law++)
        printf(",%s", kempe_contact_law_name((kempe_creep_law)law));
    printf("\n");
    for (int k = 0; k <= 240; k++) {
        kempe_creep c = {.a = 6.304e-3,
                         .b = 12.61e-3,
                         .shear_modulus = 82e9,
                         .poisson = 0.28,
                         .normal = 106.7e3,
                         .friction = 0.33,
                         .strips = 200};
        int along = k <= 120;
        double at = along ? 6e-3 * k / 120 : 1.5 * (k - 120) / 120;
        if (along)
            c.slip[0] = at;
        else
            c.spin = at;
        printf("%s,%g", along ? "creep" : "spin", at);
        for (int law = KEMPE_CREEP_LINEAR; law <= KEMPE_CREEP_FASTSIM; law++) {
            kempe_creep_force f = {{0, 0}, 0, 0};
            (void)kempe_contact_creep((kempe_creep_law)law, &c, &f);
            printf(",%.5f", -f.force[along ? 0 : 1] / (c.friction * c.normal));
        }
        printf("\n");
    }
}

int bench_laws(int count, char **words)
{
    if (count > 1 && strcmp(words[1], "csv") == 0) {
        print_curves();
        return 0;
    }
    print_costs();
    print_accuracy();
    return 0;
}
