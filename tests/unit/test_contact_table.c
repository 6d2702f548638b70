/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of contacts: the places against averages over the surfaces in space, the normal force against Hertz at the
 * depth that is found so, and what is told of words that are wrong. */
#include "loaded.h"
#include "model/data/wheels.h"
#include "rail/wheel_contact/contact_sweep.h"
#include "refused_contacts.h"
#include "symbolic/table_function.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <stdlib.h>

static const char manchester[] = "examples/manchester/manchester.yaml";

/* -- a wheel in space ------------------------------------------------------------------------------------- */

/* Axes: forwards, left, up. */
typedef struct pose {
    const kmp_wheel *wheel;
    const kmp_track *track;
    double side; /* +1: outwards is left */
    double centre[3], axle[3], down[3], ahead[3];
} pose;

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* The wheel of a half of the model: its joint has z, x, y, yaw and roll in this order. */
static pose pose_of(const loaded *l, int wheel, const double *q)
{
    const kmp_wheel *w = kmp_model_wheel(l->system->model, wheel);
    pose p = {
        .wheel = w, .track = kmp_model_track(l->system->model, w->track), .side = w->side == KMP_TRACK_LEFT ? 1 : -1};
    q += 6 * wheel;
    double sy = sin(q[3]), cy = cos(q[3]), sr = sin(q[4]), cr = cos(q[4]);
    const double axle[3] = {-sy * cr, cy * cr, sr}, origin[3] = {q[1], q[2], q[0]}, up[3] = {0, 0, 1};
    for (int k = 0; k < 3; k++) {
        p.axle[k] = p.side * axle[k];
        p.centre[k] = origin[k] + 0.75 * p.axle[k];
    }
    cross(axle, up, p.ahead);
    double length = sqrt(p.ahead[0] * p.ahead[0] + p.ahead[1] * p.ahead[1]);
    for (int k = 0; k < 3; k++)
        p.ahead[k] /= length;
    cross(axle, p.ahead, p.down);
    return p;
}

/* Height above the rail and lateral place of the wheel's point at s and at an angle from its lowest one. */
static double height(const pose *p, double s, double angle, double *y)
{
    double r = p->wheel->radius.value - kmp_table_value(p->wheel->profile->height, 0, s), at[3];
    for (int k = 0; k < 3; k++)
        at[k] = p->centre[k] + s * p->axle[k] + r * (cos(angle) * p->down[k] + sin(angle) * p->ahead[k]);
    *y = p->side * at[1];
    return at[2] - kmp_table_value(p->track->rail, 0, *y);
}

/* The least over the angle, by golden sections. */
static double lowest(const pose *p, double s, double *y)
{
    double a = -0.1, b = 0.1, part = (sqrt(5) - 1) / 2;
    for (int k = 0; k < 60; k++) {
        double c = b - part * (b - a), d = a + part * (b - a), unused;
        if (height(p, s, c, &unused) < height(p, s, d, &unused))
            b = d;
        else
            a = c;
    }
    return height(p, s, (a + b) / 2, y);
}

/* Averages over a zone with exp(-gap/e), 20 um apart: of the places on wheel and rail and of the rail's slope; the
 * curvature and the least gap of the parabola that has the same variance and integral. */
typedef struct spread {
    double s, y, slope, bend, least;
} spread;

enum { FINE = 5000 };
static const double step = 20e-6;

static spread spread_by(int count, const double *s, const double *y, const double *gap, const double *slope, double e)
{
    double least = HUGE_VAL, sum[5] = {0};
    for (int k = 0; k < count; k++)
        least = fmin(least, gap[k]);
    for (int k = 0; k < count; k++) {
        double w = exp((least - gap[k]) / e);
        sum[0] += w;
        sum[1] += w * s[k];
        sum[2] += w * s[k] * s[k];
        sum[3] += w * slope[k];
        sum[4] += w * y[k];
    }
    double mean = sum[1] / sum[0], variance = sum[2] / sum[0] - mean * mean;
    return (spread){.s = mean,
                    .y = sum[4] / sum[0],
                    .slope = sum[3] / sum[0],
                    .bend = e / variance,
                    .least = least - e * log(sum[0] * step / sqrt(2 * acos(-1) * variance))};
}

/* The spread is a fifth of the penetration that a wider, fixed one gives, and never below the least one: the fourth
 * root of the sum of their fourth powers. */
static spread lying(const pose *p, int zone)
{
    static double s[FINE], y[FINE], gap[FINE], slope[FINE];
    int count = 0;
    for (double at = p->wheel->zone[zone][0]; at < p->wheel->zone[zone][1] && count < FINE; at += step) {
        s[count] = at;
        gap[count] = lowest(p, at, &y[count]);
        slope[count] = kmp_table_value(p->track->rail, 1, y[count]);
        count++;
    }
    CHECK(count < FINE); /* the whole zone */
    double least = p->wheel->least_spread[zone], deep = -spread_by(count, s, y, gap, slope, 4 * least).least;
    return spread_by(count, s, y, gap, slope, sqrt(hypot(0.04 * deep * deep, least * least)));
}

/* The force of Hertz of the parabola. */
static double press(const pose *p, const spread *all)
{
    double slope = kmp_table_value(p->wheel->profile->height, 1, all->s), depth = -all->least * cos(atan(all->slope));
    double r = p->wheel->radius.value - kmp_table_value(p->wheel->profile->height, 0, all->s);
    kempe_touch touch = {1 / (r * sqrt(1 + slope * slope)), all->bend / pow(1 + all->slope * all->slope, 1.5),
                         p->wheel->shear_modulus.value, p->wheel->poisson};
    kempe_ellipse ellipse = {.stiffness = NAN};
    CHECK(kempe_contact_hertz(&touch, 1, &ellipse) == KEMPE_OK);
    return ellipse.stiffness * pow(depth, 1.5);
}

/* The differences are known. 20 um are fine enough: 10 um give the same results. The table sums over places up to 1.2
 * standard deviations apart: 1.3 um and a slope of 1e-4 where arcs meet within the patch. And it takes of each circle
 * not the lowest point but that of the trace line (rail/wheel/patch.c), which is the same one at the contact: where a
 * flange is turned 2.4e-4 of the slope, and half a percent of the force, as its curvature is by y and not by s. */
static void contacts_are_where_surfaces_lie_on_each_other(void)
{
    loaded l = load(manchester);
    kempe_contacts *table = NULL;
    const kempe_contact_options options = {.sweep = "shift=0:10 mm:6"};
    CHECK(l.system && kempe_contacts_new(l.system, &options, &table) == KEMPE_OK);
    int seen = 0;
    for (int row = 0; table && row < table->count; row++)
        for (int w = 0; w < 2; w++)
            for (int z = 0; z < kempe_contacts_zone_count(table, w); z++) {
                const kempe_contact_patch *c = kempe_contacts_patch(table, row, w, z);
                pose p = pose_of(&l, w, table->q + row * table->system->n);
                if (!c->touches)
                    continue;
                spread all = lying(&p, z);
                CHECK(fabs(all.s - c->s) < 2e-6);
                CHECK(fabs(all.y - c->y) < 2e-6);
                CHECK(fabs(press(&p, &all) / c->normal - 1) < 1e-2);
                CHECK(fabs(tan(c->angle) - all.slope) < 3e-4);
                seen++;
            }
    CHECK(seen >= 12);
    kempe_contacts_free(table);
    unload(&l);
}

/* -- states --------------------------------------------------------------------------------------------------- */

/* The model with more sections. */
static loaded with(const char *more)
{
    enum { ROOM = 1 << 14 };
    char path[1024], text[ROOM];
    (void)snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, manchester);
    FILE *file = fopen(path, "rb");
    size_t length = file ? fread(text, 1, ROOM / 2, file) : 0;
    CHECK(length > 0 && length < ROOM / 2);
    if (file)
        (void)fclose(file);
    (void)snprintf(text + length, ROOM - length, "%s", more);
    return load_text_as(text, path);
}

/* A cylinder presses on a wheel: at its pressure in equilibrium, 2000 N wherever it starts, it is a constant force. */
static void states_are_balanced(void)
{
    static const char *const sections[] = {
        "forces: {w: {joint: left.1, force: -2000}}\n",
        "states: {p: {rate: 2000 - p}}\nforces: {w: {joint: left.1, force: -p}}\n",
        "states: {p: {start: 5000, rate: 2000 - p}}\nforces: {w: {joint: left.1, force: -p}}\n"};
    double normal[3] = {0};
    for (int k = 0; k < 3; k++) {
        loaded l = with(sections[k]);
        kempe_contacts *table = NULL;
        const kempe_contact_options options = {.sweep = "shift=0:10 mm:2"};
        CHECK(l.system && kempe_contacts_new(l.system, &options, &table) == KEMPE_OK);
        for (int z = 0; table && z < kempe_contacts_zone_count(table, 0); z++)
            normal[k] += kempe_contacts_patch(table, 0, 0, z)->normal;
        kempe_contacts_free(table);
        unload(&l);
    }
    CHECK(normal[0] > 11000);
    CHECK_NEAR(normal[1], normal[0], 1e-6);
    CHECK_NEAR(normal[2], normal[0], 1e-6);
}

/* Rigid cones on round rails: Hertz's ellipse, for which a cone is straight and a rail an arc. Left and right are
 * mirror images, and small creepages give the forces of the linear theory. */
static void pressures_of_cones_are_those_of_hertz(void)
{
    static const char *const methods[] = {"analyn", "half-space"};
    loaded l = load("examples/rolling_wheel/rolling_wheel.yaml");
    for (int m = 0; m < 2; m++) {
        const kempe_contact_options options = {
            .sweep = "y=-3 mm:3 mm:2", .hold = "yaw", .pressure = methods[m], .law = m ? "half-space" : NULL};
        kempe_contacts *table = NULL;
        CHECK(kempe_contacts_new(l.system, &options, &table) == KEMPE_OK);
        for (int row = 0; table && row < 2; row++)
            for (int w = 0; w < 2; w++) {
                const kempe_contact_patch *p = kempe_contacts_patch(table, row, w, 0);
                const kempe_contact_patch *other = kempe_contacts_patch(table, 1 - row, 1 - w, 0);
                double area = acos(-1) * p->a * p->b;
                CHECK_NEAR(p->pressure / (1.5 * p->normal / area), 1, 2e-3);
                CHECK_NEAR(p->area / area, 1, 5e-3);
                CHECK(p->lobes == 1 && p->one_ellipse == -1);
                CHECK(!m || fabs(p->by_law[0] / p->force[0] - 1) <= 0.03);
                CHECK(!m || fabs(p->by_law[1] / p->force[1] - 1) <= 0.06);
                CHECK_NEAR(other->pressure / p->pressure, 1, 1e-9);
                CHECK(!m || fabs(other->by_law[0] / p->by_law[0] - 1) <= 1e-6);
                CHECK(!m || fabs(other->by_law[1] / p->by_law[1] + 1) <= 1e-6);
            }
        kempe_contacts_free(table);
    }
    unload(&l);
}

/* -- words ---------------------------------------------------------------------------------------------------- */

static void wrong_words_are_reported(void)
{
    loaded l = load(manchester), without = load("examples/four_bar/four_bar.yaml");
    refuses(&without, (kempe_contact_options){.sweep = "A=0:1"}, "the model has no wheels");
    refuses(&l, (kempe_contact_options){.sweep = NULL}, "the sweep is missing");
    refuses(&l, (kempe_contact_options){.sweep = "shaft=0:1"}, "shaft");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .hold = "nothing"}, "hold");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .law = "coulomb"}, "unknown creep law 'coulomb'");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .pressure = "hertz"}, "unknown method 'hertz'");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .pressure = "half-space:9"}, "'half-space:9'");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .pressure = "analyn:2"}, "'analyn:2'");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .law = "half-space", .pressure = "analyn"},
            "--law half-space");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .solve_for = "left.1"},
            "solve-for: 'left.1' does not move");
    refuses(&l, (kempe_contact_options){.sweep = "shift=0:1 mm", .points = 1}, "1 values");
    refuses(&l, (kempe_contact_options){.sweep = "left.1=0:1,left.1=0:2"}, "is given twice");
    refuses(&l, (kempe_contact_options){.sweep = "left.1=0:1 rad"}, "left.1");
    unload(&l);
    unload(&without);
}

/* Beside the rails a run would end, and a table has no row; far away no row of h can be kept, and nothing asks for its
 * multiplier. */
static void beside_the_rails(void)
{
    loaded l = load("examples/rolling_wheel/rolling_wheel.yaml");
    static const char *const places[] = {"y=-150 mm", "y=-5"};
    for (int k = 0; k < 2; k++) {
        kempe_contacts *table = NULL;
        const kempe_contact_options options = {.sweep = places[k], .hold = "yaw"};
        CHECK(kempe_contacts_new(l.system, &options, &table) == KEMPE_E_FAILED);
        CHECK(table == NULL && strstr(kempe_context_message(l.context), "wheel 'L' left its rail"));
    }
    unload(&l);
}

int main(void)
{
    TEST(contacts_are_where_surfaces_lie_on_each_other);
    TEST(states_are_balanced);
    TEST(pressures_of_cones_are_those_of_hertz);
    TEST(wrong_words_are_reported);
    TEST(beside_the_rails);
    return check_report();
}
