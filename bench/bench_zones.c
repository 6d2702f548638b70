/* SPDX-License-Identifier: BSD-3-Clause */
/* Patches of any shape in the benchmark of Manchester, case: pressures, areas, approaches and creep forces beside
 * those of CONTACT (examples/manchester/reference.csv) and of the approximations that it contains
 * (approximations.csv), the effect of finer grids, and processor time.
 *
 *     bench zones         42 rows, and the largest errors of each method
 *     bench zones finer   also grids of rectangles divided by 2 and 3 (two minutes) */
#include "bench.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

enum { VALUES = 21, WHEELS = 2, METHODS = 6, FIGURES = 3 };

typedef struct reference {
    double force[2], figure[FIGURES]; /* pressure, area, approach */
} reference;

typedef struct method {
    const char *pressure, *law;
    kempe_contacts *table;
    double seconds;
} method;

static reference given[VALUES][WHEELS];

static FILE *open_file(const char *name)
{
    char path[512];
    (void)snprintf(path, sizeof path, "examples/manchester/%s", name);
    FILE *f = fopen(path, "r");
    if (!f) {
        fprintf(stderr, "cannot read %s\n", path);
        exit(1);
    }
    return f;
}

static void read_reference(void)
{
    FILE *f = open_file("reference.csv");
    char line[512], wheel;
    double shift, skipped;
    while (fgets(line, sizeof line, f)) {
        reference r;
        if (sscanf(line, "%lf,%c,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &shift, &wheel, &skipped, &skipped,
                   &skipped, &skipped, &skipped, &skipped, &r.force[0], &r.force[1], &r.figure[0], &r.figure[1],
                   &r.figure[2]) == 13)
            given[(int)lround(shift * 2000)][wheel == 'R'] = r;
    }
    (void)fclose(f);
}

static void make(const bench *b, method *m)
{
    const kempe_contact_options options = {.sweep = "shift=0:10 mm:21", .pressure = m->pressure, .law = m->law};
    double begun = bench_now();
    if (kempe_contacts_new(b->system, &options, &m->table) != KEMPE_OK) {
        fprintf(stderr, "%s\n", kempe_context_message(b->context));
        exit(1);
    }
    m->seconds = bench_now() - begun;
}

static const kempe_contact_patch *patch_of(const kempe_contacts *t, int row, int wheel)
{
    const kempe_contact_patch *most = NULL;
    for (int z = 0; z < kempe_contacts_zone_count(t, wheel); z++) {
        const kempe_contact_patch *p = kempe_contacts_patch(t, row, wheel, z);
        if (p->touches && (!most || p->normal > most->normal))
            most = p;
    }
    return most;
}

/* Relative errors in per cent of pressure, area, approach. The table has no approach of the ellipse. */
static void errors_of(const kempe_contact_patch *p, const reference *r, bool ellipse, double error[FIGURES])
{
    double figure[FIGURES] = {p->pressure, p->area, p->approach};
    if (ellipse) {
        figure[0] = 1.5 * p->normal / (pi * p->a * p->b);
        figure[1] = pi * p->a * p->b;
        figure[2] = NAN;
    }
    for (int k = 0; k < FIGURES; k++)
        error[k] = 100 * (figure[k] / r->figure[k] - 1);
}

static double apart(const double force[2], const reference *r)
{
    return 100 * hypot(force[0] - r->force[0], force[1] - r->force[1]) / hypot(r->force[0], r->force[1]);
}

static void print_rows(const method *list, int count)
{
    printf("errors in per cent of CONTACT: largest pressure, area, approach; number of lobes\n%-7s", "wheel");
    for (int m = 0; m < count; m++)
        printf(" | %-26s", list[m].pressure ? list[m].pressure : "ellipse: 3 N/(2 pi a b)");
    printf("\n");
    for (int w = 0; w < WHEELS; w++)
        for (int row = 0; row < VALUES; row++) {
            printf("%c %4.1f ", w ? 'R' : 'L', 0.5 * row);
            for (int m = 0; m < count; m++) {
                const kempe_contact_patch *p = patch_of(list[m].table, row, w);
                double error[FIGURES];
                errors_of(p, &given[row][w], !list[m].pressure, error);
                printf(" | %+7.1f %+7.1f", error[0], error[1]);
                if (list[m].pressure)
                    printf(" %+7.1f %2d", error[2], p->lobes);
                else
                    printf("%11s", "");
            }
            printf("\n");
        }
}

static void print_largest(const method *list, int count)
{
    printf("\nlargest errors of all rows, per cent, and processor time of one patch, ms (with all else of its row)\n");
    for (int m = 0; m < count; m++) {
        double most[FIGURES] = {0};
        for (int k = 0; k < VALUES * WHEELS; k++) {
            double error[FIGURES];
            errors_of(patch_of(list[m].table, k / 2, k % 2), &given[k / 2][k % 2], !list[m].pressure, error);
            for (int i = 0; i < FIGURES; i++)
                most[i] = fmax(most[i], fabs(error[i]));
        }
        char approach[16] = "-"; /* an average, and none of the table */
        if (list[m].pressure)
            (void)snprintf(approach, sizeof approach, "%.1f", most[2]);
        printf("%-24s pressure %6.1f  area %5.1f  approach %5s  time %7.2f\n",
               list[m].pressure ? list[m].pressure : "ellipse", most[0], most[1], approach,
               1e3 * list[m].seconds / (VALUES * WHEELS));
    }
}

/* Creep forces, as vectors. */
static void print_forces(const bench *b)
{
    method list[] = {{.law = "fastsim"}, {.law = "fastsim1"}, {.law = "half-space"}};
    enum { LAWS = sizeof list / sizeof *list };
    printf("\ncreep forces: magnitude of the difference from CONTACT's, per cent of it\n%-7s | %9s", "wheel", "shen");
    for (int m = 0; m < LAWS; m++) {
        make(b, &list[m]);
        printf(" %10s", list[m].law);
    }
    double most[LAWS + 1] = {0};
    for (int k = 0; k < VALUES * WHEELS; k++) {
        int row = k % VALUES, w = k / VALUES;
        printf("\n%c %4.1f  |", w ? 'R' : 'L', 0.5 * row);
        for (int m = 0; m <= LAWS; m++) {
            const kempe_contact_patch *p = patch_of(list[m ? m - 1 : 0].table, row, w);
            double error = apart(m ? p->by_law : p->force, &given[row][w]);
            most[m] = fmax(most[m], error);
            printf(" %10.1f", error);
        }
    }
    printf("\nlargest|");
    for (int m = 0; m <= LAWS; m++)
        printf(" %10.1f", most[m]);
    printf("\ntime of one patch by half-space, ms: %.1f\n", 1e3 * list[LAWS - 1].seconds / (VALUES * WHEELS));
    for (int m = 0; m < LAWS; m++)
        kempe_contacts_free(list[m].table);
}

/* CONTACT's own approximations, and the same method here. */
static void print_approximations(const kempe_contacts *analyn)
{
    FILE *f = open_file("approximations.csv");
    char line[512], name[32];
    double shift, figure[FIGURES];
    printf("\napproximations in CONTACT, right wheel: errors as above; of ANALYN here\n");
    while (fgets(line, sizeof line, f))
        if (sscanf(line, "%lf,%31[^,],%lf,%lf,%lf", &shift, name, &figure[0], &figure[1], &figure[2]) == 5) {
            int row = (int)lround(shift * 2000);
            printf("%4.1f %-7s |", shift * 1e3, name);
            for (int k = 0; k < FIGURES; k++)
                printf(" %+7.1f", 100 * (figure[k] / given[row][1].figure[k] - 1));
            double error[FIGURES];
            errors_of(patch_of(analyn, row, 1), &given[row][1], false, error);
            if (strcmp(name, "analyn") == 0)
                printf(" | %+7.1f %+7.1f %+7.1f", error[0], error[1], error[2]);
            printf("\n");
        }
    (void)fclose(f);
}

int bench_zones(int argc, char **argv)
{
    method list[METHODS] = {{.pressure = NULL},         {.pressure = "kik-piotrowski"}, {.pressure = "analyn"},
                            {.pressure = "half-space"}, {.pressure = "half-space:2"},   {.pressure = "half-space:3"}};
    int count = argc > 1 && strcmp(argv[1], "finer") == 0 ? METHODS : 4;
    bench b = bench_load("examples/manchester/manchester.yaml");
    read_reference();
    for (int m = 0; m < count; m++)
        make(&b, &list[m]);
    print_rows(list, count);
    print_largest(list, count);
    print_approximations(list[2].table);
    print_forces(&b);
    for (int m = 0; m < count; m++)
        kempe_contacts_free(list[m].table);
    bench_free(&b);
    return 0;
}
