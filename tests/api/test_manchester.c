/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 6 */
/* The Manchester contact benchmark, case A-2.2, against what CONTACT gives for it (examples/manchester): where wheels
 * touch, normal forces, creepages, and creep forces by the wheel's law and by FASTSIM. Rows where a contact goes over
 * from one place to another are told apart by what is seen in them, not by how well they do. */
#include "testing.h"
#include <kempe/kempe.h>
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <stdbool.h>
#include <stdlib.h>

enum { VALUES = 21, WHEELS = 2 };

typedef struct contact {
    double y, angle, normal, slip[2], spin, force[2], pressure, area, approach;
} contact;

static contact reference[VALUES][WHEELS];
static kempe_context *context;
static kempe_model *model;
static kempe_system *system_;
static kempe_contacts *table;

static void read_reference(void)
{
    FILE *f = fopen(KEMPE_ROOT "/examples/manchester/reference.csv", "r");
    char line[512];
    int count = 0;
    CHECK(f != NULL);
    while (f && fgets(line, sizeof line, f)) {
        contact c;
        double shift;
        char wheel;
        if (sscanf(line, "%lf,%c,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &shift, &wheel, &c.y, &c.angle,
                   &c.normal, &c.slip[0], &c.slip[1], &c.spin, &c.force[0], &c.force[1], &c.pressure, &c.area,
                   &c.approach) != 13)
            continue;
        reference[(int)(shift * 2000 + 0.5)][wheel == 'R'] = c;
        count++;
    }
    if (f)
        fclose(f);
    CHECK(count == VALUES * WHEELS);
}

static kempe_contacts *table_by(const char *pressure, const char *law)
{
    const kempe_contact_options options = {.sweep = "shift=0:10 mm:21", .law = law, .pressure = pressure};
    kempe_contacts *made = NULL;
    CHECK(system_ && kempe_contacts_new(system_, &options, &made) == KEMPE_OK);
    printf("%s", made ? "" : kempe_context_message(context));
    return made;
}

static void begin(void)
{
    read_reference();
    context = kempe_context_new();
    CHECK(kempe_model_read(context, KEMPE_ROOT "/examples/manchester/manchester.yaml", &model) == KEMPE_OK);
    CHECK(model && kempe_system_new(model, &system_) == KEMPE_OK);
    table = table_by("half-space", "fastsim1");
    kempe_table *states = NULL;
    CHECK(kempe_contacts_table(table, "states", &states) == KEMPE_OK && kempe_table_row_count(states) == VALUES);
    kempe_table_free(states);
}

/* The one that carries most. */
static const kempe_contact_patch *main_patch(int row, int wheel)
{
    const kempe_contact_patch *best = NULL;
    for (int z = 0; z < kempe_contacts_zone_count(table, wheel); z++) {
        const kempe_contact_patch *p = kempe_contacts_patch(table, row, wheel, z);
        if (p->touches && (!best || p->normal > best->normal))
            best = p;
    }
    CHECK(best != NULL);
    return best;
}

/* Centred, and at 0.5 mm on the right, the reference's patch has two lobes, one on the rail's arc of 300 mm and one on
 * that of 80 mm; at 5 mm the right wheel touches at two places, on its tread and at the root of its flange. */
static bool goes_over(int row, int wheel)
{
    return row == 0 || (wheel == 1 && (row == 1 || row == 10));
}

/* Just beyond, the reference's patch is an egg, half a millimetre from two lobes: its place, angle and creepages are
 * met, FASTSIM on an ellipse does not meet its force. */
static bool is_egg(int row, int wheel)
{
    return wheel == 0 && row == 1;
}

static bool on_flange(int row, int wheel)
{
    return wheel == 1 && row >= 13;
}

static double size(const double x[2])
{
    return hypot(x[0], x[1]);
}

static double apart(const double a[2], const double b[2])
{
    return hypot(a[0] - b[0], a[1] - b[1]) / size(b);
}

static void wheels_touch_where_they_should(void)
{
    for (int row = 0; row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            CHECK(fabs(p->y - r->y) <= 0.3e-3);
            CHECK(fabs(p->angle / r->angle - 1) <= 0.05);
            CHECK(fabs(p->normal / r->normal - 1) <= 0.02);
        }
}

/* On the grid: the reference's own accuracy is that of its elements. On the flange the whole patch is 4 to 5 of them
 * wide, and areas are smaller by 6 to 9 %; at 5 mm on the right the small lobe on the tread is sensitive to the gap. */
static void pressures_agree(void)
{
    for (int row = 0; row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            bool coarse = w == 1 && (goes_over(row, w) || on_flange(row, w));
            CHECK(fabs(p->pressure / r->pressure - 1) <= (coarse ? 0.035 : 0.02));
            CHECK(fabs(p->area / r->area - 1) <= (on_flange(row, w) || row == 10 || row == 11 ? 0.095 : 0.035));
            CHECK(fabs(p->approach / r->approach - 1) <= (coarse ? 0.035 : 0.01));
            CHECK(p->lobes == (w == 1 && row == 10 ? 2 : 1));
        }
}

/* The strips of ANALYN: 12 % in the pressure, as in its own table (mbench_a22_kpec.ref_out of CONTACT, where it
 * has 4.1, 12.3 and 4.6 % at 0, 0.5 and 5 mm on the right). Without the interaction of the strips both places at 5 mm
 * do not touch: the approach is 9 % too large, and a third of the area is missing. */
static void strips_agree(void)
{
    kempe_contacts *half_space = table;
    table = table_by("analyn", "fastsim1");
    for (int row = 0; table && row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            bool two = w == 1 && row == 10, bent = goes_over(row, w) || on_flange(row, w);
            CHECK(fabs(p->pressure / r->pressure - 1) <= (bent ? 0.12 : 0.08));
            CHECK(fabs(p->area / r->area - 1) <= (two ? 0.36 : bent ? 0.13 : 0.065));
            CHECK(fabs(p->approach / r->approach - 1) <= (two ? 0.1 : bent ? 0.04 : 0.015));
        }
    kempe_contacts_free(table);
    table = half_space;
}

/* The tractions of rolling on the grid, at the state's creepages: 4 % where longitudinal forces of two lobes balance, 2
 * % where the ellipse misses up to 17 %, and elsewhere 0.5 %, for the same normal force. */
static void forces_on_the_grid_agree(void)
{
    kempe_contacts *pressed = table;
    table = table_by(NULL, "half-space");
    for (int row = 0; table && row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            double same = r->normal / p->normal, within = row == 0                              ? 0.045
                                                          : goes_over(row, w) || is_egg(row, w) ? 0.02
                                                                                                : 0.005;
            const double by_law[] = {same * p->by_law[0], same * p->by_law[1]};
            CHECK(apart(by_law, r->force) <= within);
            CHECK(p->pressure > 0);
        }
    kempe_contacts_free(table);
    table = pressed;
}

/* The outline has the area, lobe by lobe, and the largest pressure. */
static void outlines_agree(void)
{
    kempe_table *outline = NULL;
    CHECK(kempe_contacts_table(table, "outline", &outline) == KEMPE_OK);
    const kempe_contact_patch *p = main_patch(10, 1);
    double area = 0, pressure = 0, last = 0, step = 1;
    int lobes = 0, from = kempe_table_find(outline, "from"), to = kempe_table_find(outline, "to");
    for (int k = 0; k < kempe_table_row_count(outline); k++) {
        double y = kempe_table_number(outline, k, kempe_table_find(outline, "y"));
        if (fabs(kempe_table_number(outline, k, 0) - 5e-3) > 1e-9 || strcmp(kempe_table_word(outline, k, 1), "R") != 0)
            continue;
        int lobe = (int)kempe_table_number(outline, k, kempe_table_find(outline, "lobe"));
        step = lobe == lobes ? fmin(step, (y - last) / cos(p->angle)) : step;
        lobes = lobe;
        area += kempe_table_number(outline, k, to) - kempe_table_number(outline, k, from);
        pressure = fmax(pressure, kempe_table_number(outline, k, kempe_table_find(outline, "pressure")));
        last = y;
    }
    CHECK(lobes == 2 && pressure == p->pressure);
    CHECK(fabs(area * step / p->area - 1) <= 0.05);
    kempe_table_free(outline);
}

/* Without a patch of the reference, and on the right up to 2 mm, where an end of it is still on the other arc, a, b and
 * N do not determine pressures: the reference's largest is 1556 MPa at 5 mm on the right, where they make 418, 632 and
 * 741 at 0.5 and 1 mm, where they make 286 and 537. */
static void ellipses_are_told_from_others(void)
{
    for (int row = 0; row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            bool other = goes_over(row, w) || is_egg(row, w) || (w == 1 && row >= 2 && row <= 4);
            CHECK(main_patch(row, w)->one_ellipse == !other);
        }
    const kempe_contact_patch *p = main_patch(10, 1);
    CHECK(fabs(1.5 * p->normal / (3.14159265358979 * p->a * p->b) - 418e6) < 2e6);
}

static void creepages_agree(void)
{
    for (int row = 0; row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            if (goes_over(row, w))
                continue;
            CHECK(fabs(p->slip[0] - r->slip[0]) <= 0.02 * size(r->slip));
            CHECK(fabs(p->slip[1] - r->slip[1]) <= 0.02 * size(r->slip));
            CHECK(fabs(p->spin / r->spin - 1) <= 0.06);
        }
}

/* FASTSIM with one flexibility: 1 %, where the patch slides. At 1 mm the creepages would make twice the force that
 * friction bears. Under the pressure of Hertz all of the patch slides from about there on (of a roller exactly:
 * Carter). FASTSIM's bound is a paraboloid, under which its edge sticks up to 32/(3 pi) = 3.4 times that force. Without
 * spin it lacks 8/(3 pi) times the integral of (sqrt(1 - y^2) - k)^3 over |y| < sqrt(1 - k^2): 4.7 % for k = 2/3.4. */
static double by_law_within(int row)
{
    return row == 2 ? 0.05 : 0.01;
}

/* Their size within 2 %, where the wheel turns to its flange with the direction off by 6 degrees at most. By the law
 * they are compared at the same normal force, with which they go where all slides. */
static void forces_agree(void)
{
    for (int row = 0; row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            if (goes_over(row, w))
                continue;
            CHECK(fabs(size(p->force) / size(r->force) - 1) <= 0.02);
            CHECK(apart(p->force, r->force) <= (on_flange(row, w) ? 0.12 : 0.04));
            double same = r->normal / p->normal;
            const double by_law[] = {same * p->by_law[0], same * p->by_law[1]};
            CHECK(is_egg(row, w) || apart(by_law, r->force) <= by_law_within(row));
        }
}

/* At what the reference says of the contact: with three flexibilities, and with Kalker's one (1982), their mean weighed
 * by what each makes. The latter is nearly exact: where all slips, three turn the force away from the creepage. */
static void fastsim_agrees_at_the_given_contact(void)
{
    for (int row = 0; row < VALUES; row++)
        for (int w = 0; w < WHEELS; w++) {
            const kempe_contact_patch *p = main_patch(row, w);
            const contact *r = &reference[row][w];
            const kempe_creep creep = {.a = p->a,
                                       .b = p->b,
                                       .shear_modulus = 82e9,
                                       .poisson = 0.28,
                                       .normal = r->normal,
                                       .friction = 0.3,
                                       .slip = {r->slip[0], r->slip[1]},
                                       .spin = r->spin,
                                       .strips = 100};
            kempe_creep_force three, one;
            if (goes_over(row, w) || is_egg(row, w))
                continue;
            CHECK(kempe_contact_creep(KEMPE_CREEP_FASTSIM, &creep, &three) == KEMPE_OK);
            CHECK(kempe_contact_creep(KEMPE_CREEP_FASTSIM1, &creep, &one) == KEMPE_OK);
            CHECK(apart(three.force, r->force) <= (on_flange(row, w) ? 0.07 : 0.04));
            CHECK(apart(one.force, r->force) <= by_law_within(row));
        }
}

int main(void)
{
    begin();
    if (check_failures == 0) {
        TEST(wheels_touch_where_they_should);
        TEST(ellipses_are_told_from_others);
        TEST(creepages_agree);
        TEST(forces_agree);
        TEST(fastsim_agrees_at_the_given_contact);
        TEST(pressures_agree);
        TEST(strips_agree);
        TEST(forces_on_the_grid_agree);
        TEST(outlines_agree);
    }
    kempe_contacts_free(table);
    kempe_system_free(system_);
    kempe_model_free(model);
    kempe_context_free(context);
    return check_failures > 0 || check_report();
}
