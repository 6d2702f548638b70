/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction of rigid contacts whose slip has two directions, against the digits of bench/machines/contact_digits.py; the
 * cone at rest. */
#include "ways.h"
#include <kempe/equilibrium.h>
#include <math.h>
#include <string.h>

#define G 9.81

static double time_of(const kempe_trajectory *run, const char *kind, int n)
{
    const kmp_log_entry *e = entry(run, kind, n);
    return e ? e->t : -1;
}

static loaded model; /* of the run */

static kempe_trajectory *go(const char *path, const kempe_setting *settings, int count, const way *by, double t)
{
    model = load_set(path, settings, count);
    return simulate(&model, by, t);
}

static void end(kempe_trajectory *run)
{
    kempe_trajectory_free(run);
    unload(&model);
}

/* Across an incline: with the slope of the angle of friction the speed and its part down the slope have a constant sum;
 * with more friction the puck stops. */
static void across_an_incline(void)
{
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = go("tests/models/contact_incline.yaml", NULL, 0, &ways[k], 1);
        if (run) {
            CHECK_NEAR(last_q(run)[0], 0.8471100124487581919, e);
            CHECK_NEAR(last_q(run)[1], 0.5386819697150027696, e);
            CHECK_NEAR(hypot(last_qd(run)[0], last_qd(run)[1]) + last_qd(run)[0], 2, e);
            CHECK(run->verdict.drift_rel < 100 * e && !entry(run, "friction", 1));
        }
        end(run);
        run = go("tests/models/contact_incline.yaml", (const kempe_setting[]){{"mu", "0.8"}}, 1, &ways[k], 2);
        if (run) {
            CHECK_TEXT(entry(run, "friction", 0)->text, "'floor_friction' slips");
            CHECK_TEXT(entry(run, "friction", 1)->text, "'floor_friction' sticks");
            CHECK_NEAR(time_of(run, "friction", 1), 0.6141207490382808216, e);
            CHECK_NEAR(last_q(run)[0], 0.2216017373576208837, e);
            CHECK_NEAR(last_q(run)[1], 0.3383180174342695245, e);
            CHECK_NEAR(last_lambda(run)[1], -G, 1e-10);
            CHECK_NEAR(last_lambda(run)[2], 0, 1e-10);
        }
        end(run);
    }
}

/* Three feet: their directions differ and turn, and all stop at one instant. */
static void a_stool_spins(void)
{
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = go("tests/models/contact_spin.yaml", NULL, 0, &ways[k], 1);
        if (run) {
            for (int foot = 3; foot < 6; foot++)
                CHECK_NEAR(time_of(run, "friction", foot), 0.4077471967380224261, e);
            CHECK_NEAR(last_q(run)[3], 1.630988786952089704, e);
            CHECK(!entry(run, "friction", 6));
        }
        end(run);
    }
}

/* Impulses against the slip in both directions; then rest until the level is reached. */
static void oblique(void)
{
    for (int k = 0; k < WAYS; k++) {
        const double e = ways[k].tolerance;
        kempe_trajectory *run = go("tests/models/contact_oblique.yaml", NULL, 0, &ways[k], 0.6);
        if (run) {
            CHECK_NEAR(last_qd(run)[0], 2.149546191730556127, e);
            CHECK_NEAR(last_qd(run)[1], 2.866061588974074836, e);
        }
        end(run);
        run = go("tests/models/contact_oblique.yaml", (const kempe_setting[]){{"mu", "0.9"}}, 1, &ways[k], 0.6);
        CHECK(run && fabs(last_qd(run)[0]) < 1e-14 && fabs(last_qd(run)[1]) < 1e-14);
        end(run);
        run = go("tests/models/contact_oblique.yaml",
                 (const kempe_setting[]){{"mu", "0.4"}, {"h", "0"}, {"vx", "0"}, {"vy", "0"}, {"load", "2"}}, 5,
                 &ways[k], 3.95);
        if (run) {
            CHECK_NEAR(time_of(run, "friction", 1), 3.924, e);
            CHECK_TEXT(entry(run, "friction", 1)->text, "'floor_friction' slips");
        }
        end(run);
    }
}

#define BLOCK(mu, more)                                                                                                \
    "kempe: 1\n"                                                                                                       \
    "gravity: [3, 4, -10]\n"                                                                                           \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {name: x, prismatic: x, at: ground}}\n"                                                              \
    "  b: {joint: {name: y, prismatic: y, at: a}}\n"                                                                   \
    "  c: {joint: {name: z, prismatic: z, at: b}, mass: 2, points: {C: [0, 0, 0]}}\n"                                  \
    "contacts: {f: {point: c.C, on: {plane: ground.O}, restitution: 0, friction: " mu "}}\n" more

/* A load of 6 N and 8 N holds where mu times 20 N is 10 N, though each component is below that earlier. */
static void the_cone_holds(void)
{
    static const struct {
        const char *text;
        bool holds;
    } at[] = {{BLOCK("0.501", ""), true}, {BLOCK("0.499", ""), false}};
    for (int k = 0; k < 2; k++) {
        loaded l = load_text(at[k].text);
        kempe_equilibrium *e = NULL;
        kempe_equilibrium_options options = {.stick = 1};
        kempe_table *table = NULL;
        CHECK(l.system && kempe_equilibrium_new(l.system, &options, &e) == (at[k].holds ? KEMPE_OK : KEMPE_UNTRUSTED));
        CHECK(e && kempe_equilibrium_table(e, "friction", &table) == KEMPE_OK);
        if (table) {
            int force = kempe_table_find(table, "force"), part = kempe_table_find(table, "part");
            CHECK_NEAR(kempe_table_number(table, 0, force), -6, 1e-11);
            CHECK_NEAR(kempe_table_number(table, 1, force), -8, 1e-11);
            CHECK((kempe_table_number(table, 0, part) < 1) == at[k].holds);
        }
        kempe_table_free(table);
        kempe_equilibrium_free(e);
        kempe_trajectory *run = simulate(&l, &ways[0], 0.1);
        CHECK(run && (last_qd(run)[0] == 0) == at[k].holds);
        if (run && !at[k].holds) { /* along the load */
            CHECK_NEAR(last_qd(run)[0], 0.6 * (5 - 4.99) * 0.1, 1e-9);
            CHECK_NEAR(last_qd(run)[1], 0.8 * (5 - 4.99) * 0.1, 1e-9);
        }
        kempe_trajectory_free(run);
        unload(&l);
    }
}

int main(void)
{
    TEST(across_an_incline);
    TEST(a_stool_spins);
    TEST(oblique);
    TEST(the_cone_holds);
    return check_report();
}
