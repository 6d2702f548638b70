/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 4 */
/* Compliant contact and clearance: restitution of each law against its closed form, depth, force and duration of
 * contacts against their digits, stiffness by Hertz, a slider-crank with a loose pin against digits of two programs,
 * one of them examples/loose_pin/reference_loose_pin.py; its energy balance over twenty revolutions; times and depths
 * of contacts. */
#include "studies/simulate/trajectory.h"
#include "studies/simulate/trajectory_print.h"
#include "ways.h"
#include <kempe/table.h>
#include <math.h>

/* Tolerances are relative, of times and rates. */
static const way precise[] = {{"reduced", NULL, "dop853", 1e-9, 1e-14},   {"reduced", NULL, "radau", 1e-9, 1e-14},
                              {"projected", NULL, "dop853", 1e-9, 1e-14}, {"projected", NULL, "radau", 1e-9, 1e-14},
                              {"dae", NULL, "ida", 1e-6, 1e-14},          {"dae", NULL, "radau", 1e-9, 1e-14}};

enum { PRECISE = sizeof precise / sizeof *precise };

/* The times at which contact begins and ends, all and in order; further ones may follow. */
static void check_times(const kempe_trajectory *run, int count, const double *expected, double tolerance)
{
    int found = 0;
    for (int k = 0; k < run->log.kept && found < count; k++) {
        const kmp_log_entry *entry = &run->log.entries[k];
        if (strcmp(entry->kind, "event") != 0 || !strstr(entry->text, "contact '"))
            continue;
        CHECK_NEAR(entry->t, expected[found], tolerance * expected[found]);
        CHECK((strstr(entry->text, "closes") != NULL) == (found % 2 == 0));
        found++;
    }
    CHECK(found == count);
}

#define TIMES(run, tolerance, ...)                                                                                     \
    do {                                                                                                               \
        const double expected[] = {__VA_ARGS__};                                                                       \
        check_times(run, sizeof expected / sizeof *expected, expected, tolerance);                                     \
    } while (0)

/* Output k of the last row that is not in the table. */
static double last_shown(const kempe_trajectory *run, int k)
{
    return run->shown[k];
}

/* A unit mass that meets the floor at t = 1 ms with 1 m/s, without any other force. */
static loaded ball(const char *law, const char *run)
{
    char text[600];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\n"
                   "bodies: {ball: {joint: {name: z, prismatic: z, at: ground}, mass: 1}}\n"
                   "contacts: {floor: {gap: q(z), %s}}\n"
                   "start: {q: {z: 1 mm}, qd: {z: -1}}\n"
                   "run: {%soutputs: [q, force(floor)]}\n",
                   law, run);
    return load_text(text);
}

/* The restitution e of F = K d^n (1 + a d'): a v (1 + e) = ln((1 + a v) / (1 - a v e)). By d' = v over the depth,
 * v v' = -K d^n (1 + a v)/m, so that the integrals of v/(1 + a v) up and down are the same. */
static double restitution(double a)
{
    double low = 0, high = fmin(1, 1 / a);
    for (int k = 0; k < 200; k++) {
        double e = 0.5 * (low + high);
        bool less = a * (1 + e) > log((1 + a) / (1 - a * e));
        *(less ? &low : &high) = e;
    }
    return 0.5 * (low + high);
}

/* -- laws ------------------------------------------------------------------------------------------------- */

static void check_exit(const char *law, double expected)
{
    loaded l = ball(law, "");
    for (int k = 0; k < PRECISE; k++) {
        kempe_trajectory *run = simulate(&l, &precise[k], 0.1);
        if (run)
            CHECK_NEAR(last_qd(run)[0], expected, precise[k].tolerance);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* For all stiffnesses and exponents. */
static void hunt_crossley(void)
{
    static const double factors[] = {0.01, 0.1, 0.5, 1, 2};
    static const double digits[] = {0.9933774543987673634, 0.93747557994990506377, 0.74843493159743415812,
                                    0.59362426004004009232, 0.4107196860610394467};
    static const char *const numbers[] = {"stiffness: 1e6", "stiffness: 1e4, exponent: 1",
                                          "stiffness: 1e9, exponent: 2.2"};
    char law[200];
    for (int k = 0; k < 5; k++) {
        CHECK_NEAR(restitution(factors[k]), digits[k], 1e-12); /* rounding of the logarithm over a v */
        (void)snprintf(law, sizeof law, "law: hunt_crossley, damping: %g, %s", factors[k], numbers[k % 3]);
        check_exit(law, digits[k]);
    }
}

static void made_for_restitution(void)
{
    static const double wanted[] = {0.9, 0.7, 0.5, 0.3};
    char law[200];
    for (int k = 0; k < 4; k++) {
        const double c = wanted[k];
        const struct {
            const char *word;
            double factor;
        } laws[] = {{"lankarani_nikravesh", 3 * (1 - c * c) / 4},
                    {"hunt_crossley", 3 * (1 - c) / 2},
                    {"flores", 8 * (1 - c) / (5 * c)}};
        for (int i = 0; i < 3; i++) {
            (void)snprintf(law, sizeof law, "law: %s, restitution: %g, stiffness: 1e6", laws[i].word, c);
            check_exit(law, restitution(laws[i].factor));
        }
    }
}

/* The spring and damper push from the beginning and would pull before the depth is zero: there the contact has no force
 * any more. Without that the ball would leave with exp(-pi zeta/sqrt(1 - zeta^2)). From d'' + 2 zeta w d' + w^2 d = 0
 * the force is zero where w^2 d = -2 zeta w d': d' is then -exp(-zeta/sqrt(1 - zeta^2) p), cos p = 2 zeta^2 - 1. */
static void kelvin_voigt(void)
{
    const double w = 1000, zeta = 0.2, root = sqrt(1 - zeta * zeta), p = acos(2 * zeta * zeta - 1);
    char law[200];
    (void)snprintf(law, sizeof law, "law: kelvin_voigt, stiffness: %.17g, damping: %.17g", w * w, 2 * zeta * w);
    check_exit(law, exp(-zeta / root * p));
    (void)snprintf(law, sizeof law, "force: \"%.17g*depth + %.17g*rate\"", w * w, 2 * zeta * w);
    check_exit(law, exp(-zeta / root * p));
    check_exit("law: hertz, stiffness: 1e6", 1);
    check_exit("force: 1e6*depth^1.5*(1 + 0.1425*rate/impact)", restitution(0.1425)); /* 3(1 - 0.9^2)/4 */
}

/* Depth and force at their largest, duration. By v v' = -K d^n (1 + a v)/m the largest depth follows from
 * K d^(n + 1)/((n + 1) m) = v/a - ln(1 + a v)/a^2. */
static void largest_depth(void)
{
    loaded l = ball("law: hunt_crossley, damping: 0.2, stiffness: 1e6", "until: approach(floor) < 0, ");
    loaded whole = load("tests/models/compliant_depth.yaml");
    loaded elastic = ball("law: hertz, stiffness: 1e6", "");
    kempe_status status;
    for (int k = 0; k < PRECISE; k++) {
        kempe_trajectory *run = simulate_any(&l, &precise[k], 0.1, &status);
        const double e = precise[k].tolerance;
        CHECK(status == KEMPE_OK);
        if (run) {
            CHECK_NEAR(last_shown(run, 0), 266.682440591182133, e * 1000);
            CHECK_NEAR(last_shown(run, 2), pow(2.5e-6 * (1 / 0.2 - log(1.2) / 0.04), 0.4), e * 0.01);
            CHECK_NEAR(last_shown(run, 2), 0.0041431400504978336419, e * 0.01);
        }
        kempe_trajectory_free(run);
        if ((run = simulate(&whole, &precise[k], 0.1)))
            TIMES(run, e, 0.001, 0.01399164240163874);
        kempe_trajectory_free(run);
        if ((run = simulate(&elastic, &precise[k], 0.1)))
            TIMES(run, e, 0.001, 0.0138113493482468762);
        kempe_trajectory_free(run);
    }
    unload(&l);
    unload(&whole);
    unload(&elastic);
}

/* Dropped from 0.1 m: bounces until it rests on the floor, which ends the events. */
static void dropped(void)
{
    const double first = 0.155163377059, second = 0.405455673119; /* the floor is left */
    loaded l = load("tests/models/compliant_drop.yaml");
    for (int k = 0; k < PRECISE; k++) {
        const double e = precise[k].tolerance;
        kempe_trajectory *run = simulate(&l, &precise[k], 0.9);
        if (run) {
            TIMES(run, e, sqrt(0.2 / 9.81), first, first + 2 * 1.16473656956 / 9.81, second,
                  second + 2 * 0.99438193219 / 9.81, 0.621432620443);
            CHECK_NEAR(last_q(run)[0], 0.029244781446, 10 * e);
            CHECK(run->verdict.drift_rel < 1e-6);
        }
        kempe_trajectory_free(run);
    }
    kempe_trajectory *run = simulate(&l, &precise[1], 20);
    if (run) {
        CHECK_NEAR(last_q(run)[0], -pow(9.81e-6, 2.0 / 3), 1e-6);
        CHECK(run->log.kept < 400);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* -- clearance -------------------------------------------------------------------------------------------- */

/* The stiffness by Hertz, as force at a depth: steel sphere of 20 mm on a plane; journal of 9.5 mm in a bearing. */
static void stiffness(void)
{
    loaded l = load("tests/models/compliant_stiffness.yaml");
    kempe_trajectory *run = simulate(&l, &precise[0], 1e-12);
    if (run) {
        CHECK_NEAR(last_shown(run, 0), 2.144631556126232e10, 1e-14 * 2e10);
        CHECK_NEAR(last_shown(run, 5), 6.610198397896846e10, 1e-14 * 7e10);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* Pin of a slider-crank, as a loop, as a joint of the tree and in a graph of joints. */
static void loose_pin(void)
{
    static const char *const models[] = {"tests/models/compliant_pin.yaml", "tests/models/compliant_pin_tree.yaml",
                                         "tests/models/compliant_pin_graph.yaml"};
    for (int m = 0; m < 3; m++) {
        loaded l = load(models[m]);
        for (int k = 0; k < (m ? 2 : 4); k++) {
            kempe_trajectory *run = simulate(&l, &precise[k], 0.012);
            if (run) {
                TIMES(run, precise[k].tolerance, 0.00022728603203979, 0.0002807232580788, 0.000637056430168,
                      0.000690890591941, 0.00074970027984, 0.00081515044038);
                CHECK(run->verdict.drift_rel < 1e-8);
            }
            kempe_trajectory_free(run);
        }
        unload(&l);
    }
}

/* Friction by the velocity of the centres alone, as the digits have it. */
static void loose_pin_with_friction(void)
{
    loaded l = load("tests/models/compliant_pin_friction.yaml");
    for (int k = 0; k < 4; k++) {
        kempe_trajectory *run = simulate(&l, &precise[k], 0.001);
        if (run)
            TIMES(run, precise[k].tolerance, 0.00022728603203979, 0.0002807149115640, 0.0006925283641,
                  0.00074842610918);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* Johnson's cylinder in a cylinder: the load of 1e6 N/m has the depth 1.559349699922932e-5 m; too great a depth ends.
 */
static void cylinder_in_cylinder(void)
{
    static const char *const depth[] = {"1.559349699922932e-5", "1e-12", "0.27e-3"};
    kempe_status status;
    for (int k = 0; k < 3; k++) {
        loaded l = load_set("tests/models/compliant_stiffness.yaml", (const kempe_setting[]){{"depth", depth[k]}}, 1);
        kempe_trajectory *run = simulate_any(&l, &precise[0], 1e-12, &status);
        if (run && k == 0)
            CHECK_NEAR(last_shown(run, 10), 1e6, 1e-4);
        if (run && k == 1)
            CHECK(last_shown(run, 10) > 0.01 && last_shown(run, 10) < 0.1);
        if (k == 2)
            CHECK(run && strstr(kempe_trajectory_reason(run), "the depth of 'pin' reaches 0.51 clearances"));
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Twenty revolutions: the energy balance closes to the tolerance, and the normal force never pulls. Impacts amplify
 * errors, so that the motions of two ways differ after about one revolution; the balance of each must close. */
static void twenty_revolutions(void)
{
    loaded l = load("tests/models/compliant_pin.yaml");
    for (int k = 0; k < 2; k++) {
        kempe_trajectory *run = simulate(&l, &precise[2 * k], 20 * 0.012);
        kempe_table *table = NULL;
        CHECK(run && run->status == KEMPE_OK && run->verdict.drift_rel < precise[2 * k].tolerance);
        CHECK(run && kempe_trajectory_outputs(run, "force(pin)", &table) == KEMPE_OK);
        int rows = table ? kempe_table_row_count(table) : 0, pushed = 0;
        const double *normal = table ? kempe_table_values(table, kempe_table_find(table, "force.pin.normal")) : NULL;
        for (int row = 0; normal && row < rows; row++) {
            CHECK(normal[row] >= 0);
            pushed += normal[row] > 0;
        }
        CHECK(pushed > rows / 10 && pushed < rows);
        kempe_table_free(table);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* The times of contacts are those of the log, and the part of time is their sum. */
static void check_contact_times(const kempe_trajectory *run, const kmp_contact_times *times)
{
    double touching = 0, largest = 0;
    int found = 0, entry = 0;
    for (int k = 0; k < run->log.contact_count; k++) {
        const kmp_contact_time *contact = &run->log.contacts[k];
        const double ends[] = {contact->from, contact->until};
        for (int i = 0; i < 2 && !isnan(ends[i]); i++) {
            while (entry < run->log.kept && !strstr(run->log.entries[entry].text, "contact 'pin'"))
                entry++;
            CHECK(entry < run->log.kept && run->log.entries[entry++].t == ends[i]);
        }
        touching += (isnan(contact->until) ? run->report.t : contact->until) - contact->from;
        largest = fmax(largest, isnan(contact->most) ? 0 : kmp_contact_time_depth(run, k));
        found += !isnan(contact->most);
    }
    CHECK(times->ended == found && found > 5);
    CHECK_NEAR(times->touching, touching / run->report.t, 1e-12);
    CHECK(times->depth[KMP_DEPTHS - 1] == largest && times->depth[0] > 0);
    for (int k = 1; k < KMP_DEPTHS; k++)
        CHECK(times->depth[k] > times->depth[k - 1]);
}

/* The largest depth of a first contact is that of its rate; that of the ball by its closed form in largest_depth. */
static void contact_times(void)
{
    kmp_contact_times times;
    loaded l = load("tests/models/compliant_pin.yaml");
    kempe_trajectory *run = simulate(&l, &precise[0], 0.0125);
    char *text = NULL;
    if (run && kmp_contact_times_find(run, 0, &times) == KEMPE_OK) {
        check_contact_times(run, &times);
        CHECK(times.turning && strcmp(times.turning, "A") == 0);
        CHECK_NEAR(times.turns, 0.0125 / 0.012, 1e-9);
    }
    CHECK(run && kempe_trajectory_print(run, KEMPE_TEXT, &text) == KEMPE_OK && strstr(text, "per turn of 'A'"));
    kempe_text_free(text);
    CHECK(run && kempe_trajectory_print(run, KEMPE_JSON, &text) == KEMPE_OK && strstr(text, "\"depths\""));
    kempe_text_free(text);
    kempe_trajectory_free(run);
    unload(&l);
    l = ball("law: hunt_crossley, damping: 0.2, stiffness: 1e6", "");
    run = simulate(&l, &precise[0], 0.1);
    if (run && kmp_contact_times_find(run, 0, &times) == KEMPE_OK) {
        CHECK(times.begun == 1 && times.ended == 1 && !times.turning);
        CHECK_NEAR(times.depth[0], 0.0041431400504978336419, 1e-6);
        CHECK_NEAR(times.touching, 0.01299164240163874 / 0.1, 1e-9);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* A start that is held far from the bearing is refused with the name of the joint. */
static void pin_outside(void)
{
    static const char text[] =
        "kempe: 1\n"
        "bodies:\n"
        "  arm: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {P: [0.3, 0, 0]}}\n"
        "  bob: {joint: {name: S, prismatic: x, at: ground}, mass: 1, points: {Q: [0, 0, 0]}}\n"
        "loops: {pin: {revolute: [arm.P, bob.Q], clearance: 1 mm, contact: {law: hertz, stiffness: 1e9}}}\n"
        "start: {q: {S: 0.1}, hold: [S]}\n";
    kempe_status status;
    loaded l = load_text(text);
    kempe_trajectory *run = simulate_any(&l, &precise[0], 0.1, &status);
    CHECK(run && strstr(kempe_trajectory_reason(run), "the journal of 'pin' is not in its bearing at t = 0"));
    kempe_trajectory_free(run);
    unload(&l);
}

/* The text of a run has the number of contacts. */
static void summary(void)
{
    loaded l = load("tests/models/compliant_drop.yaml");
    kempe_trajectory *run = simulate(&l, &precise[0], 0.9);
    char *text = NULL;
    CHECK(run && kempe_trajectory_print(run, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "contact   'floor' began 4 times, largest depth 0.00543"));
    kempe_text_free(text);
    kempe_trajectory_free(run);
    unload(&l);
}

int main(void)
{
    TEST(hunt_crossley);
    TEST(made_for_restitution);
    TEST(kelvin_voigt);
    TEST(largest_depth);
    TEST(dropped);
    TEST(stiffness);
    TEST(loose_pin);
    TEST(loose_pin_with_friction);
    TEST(cylinder_in_cylinder);
    TEST(pin_outside);
    TEST(twenty_revolutions);
    TEST(contact_times);
    TEST(summary);
    return check_report();
}
