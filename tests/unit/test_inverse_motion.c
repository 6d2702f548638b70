/* SPDX-License-Identifier: BSD-3-Clause */
/* Inverse dynamics of motions from tables and drives: derivatives between rows, branches, coarse tables, change points.
 */
#include "analyses/inverse/prescribed_motion.h"
#include "inverted.h"
#include <kempe/workspace.h>

/* x^5/10 - x^3 + 2x^2 - 1 */
static void quintic(double x, double out[3])
{
    out[0] = x * x * x * x * x / 10 - x * x * x + 2 * x * x - 1;
    out[1] = x * x * x * x / 2 - 3 * x * x + 4 * x;
    out[2] = 2 * x * x * x - 6 * x + 4;
}

/* Given values are kept, and a quintic is reproduced between uneven rows; values alone give a cubic. */
static void a_motion_of_points(void)
{
    const double t[] = {0, 0.3, 0.5, 1.1, 1.4, 2};
    enum { ROWS = 6 };
    double q[2 * ROWS], qd[2 * ROWS], qdd[2 * ROWS], at[3], x[2], v[2], a[2];
    kmp_prescribed m;
    kmp_gap_in_table gap;
    for (int r = 0; r < ROWS; r++) {
        quintic(t[r], at);
        q[2 * r] = at[0];
        qd[2 * r] = at[1];
        qdd[2 * r] = at[2];
        q[2 * r + 1] = t[r] * t[r] * t[r] - t[r];
        qd[2 * r + 1] = qdd[2 * r + 1] = NAN;
    }
    CHECK(kmp_prescribed_init(&m, ROWS, t, 2, q, qd, qdd, &gap) && m.count == 2);
    for (double s = 0; s <= 2; s += 0.01) {
        quintic(s, at);
        kmp_prescribed_at(&m, s, x, v, a);
        CHECK_NEAR(x[0], at[0], 1e-14);
        CHECK_NEAR(v[0], at[1], 1e-13);
        CHECK_NEAR(a[0], at[2], 1e-12);
        CHECK_NEAR(x[1], s * s * s - s, 1e-13);
        CHECK_NEAR(v[1], 3 * s * s - 1, 1e-12);
        CHECK_NEAR(a[1], 6 * s, 1e-11);
    }
    for (int r = 0; r < ROWS; r++) {
        kmp_prescribed_at(&m, t[r], x, v, a);
        CHECK(x[0] == q[2 * r] && v[0] == qd[2 * r] && a[0] == qdd[2 * r] && x[1] == q[2 * r + 1]);
    }
    kmp_prescribed_free(&m);
    qd[2 * 4] = NAN;
    CHECK(!kmp_prescribed_init(&m, ROWS, t, 2, q, qd, qdd, &gap));
    CHECK(gap.coordinate == 0 && gap.row == 4 && gap.order == 1);
}

/* Accelerations from values alone, on even rows: their error falls with the fourth power of the distance. */
static void accelerations_of_fourth_order(void)
{
    double error[2] = {0};
    for (int fine = 0; fine < 2; fine++) {
        enum { MOST_ROWS = 401 };
        int rows = fine ? MOST_ROWS : (MOST_ROWS + 1) / 2;
        double t[MOST_ROWS], q[MOST_ROWS], none[MOST_ROWS], x, v, a;
        kmp_prescribed m;
        kmp_gap_in_table gap;
        for (int r = 0; r < rows; r++) {
            t[r] = 4.0 * r / (rows - 1);
            q[r] = sin(3 * t[r]);
            none[r] = NAN;
        }
        CHECK(kmp_prescribed_init(&m, rows, t, 1, q, none, none, &gap));
        for (double s = 1; s <= 3; s += 0.04) { /* rows of both */
            kmp_prescribed_at(&m, s, &x, &v, &a);
            error[fine] = fmax(error[fine], fabs(a + 9 * sin(3 * s)));
        }
        kmp_prescribed_free(&m);
    }
    CHECK(error[0] < 1e-5 && error[1] < error[0] / 14);
}

/* -- derivatives of a table -------------------------------------------------------------------------- */

static void count_warnings(void *user, kempe_level level, const char *line)
{
    (void)line;
    *(int *)user += level == KEMPE_LOG_WARNING;
}

/* A sine of 5 rad/s without its rates: well told by fine rows, not by coarse ones, nor by noisy ones. */
static void tables_too_coarse_are_reported(void)
{
    static const char pendulum[] = "kempe: 1\nname: pendulum\nbodies:\n"
                                   "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.5, 0, 0]}\n";
    static const struct {
        int rows;
        double noise;
        bool once, reported;
    } cases[] = {{401, 0, false, false}, {15, 0, false, true}, {15, 0, true, false}, {401, 1e-4, false, true}};
    loaded m = load_here(pendulum);
    int warnings = 0;
    kempe_context_set_log(m.context, count_warnings, &warnings);
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        char path[] = "/tmp/kempe_inverse_XXXXXX", text[32 * 1024], *json = NULL;
        int length = snprintf(text, sizeof text, "t,q.a\n");
        for (int k = 0; k < cases[c].rows; k++) {
            double t = 2.0 * k / (cases[c].rows - 1), off = cases[c].noise * sin(1e4 * k * (double)k);
            length += snprintf(text + length, sizeof text - (size_t)length, "%.17g,%.17g\n", t, sin(5 * t) + off);
        }
        write_text(&m, path, text);
        warnings = 0;
        kempe_inverse *r = invert(
            &m, &(kempe_inverse_options){.motion = path, .actuators = "a", .no_convergence_check = cases[c].once},
            cases[c].reported ? KEMPE_UNTRUSTED : KEMPE_OK);
        CHECK(warnings == cases[c].reported);
        CHECK(kempe_inverse_print(r, KEMPE_JSON, &json) == KEMPE_OK);
        CHECK(json && strstr(json, cases[c].once       ? "\"convergence\": null"
                                   : cases[c].reported ? "\"result\": \"not converged\""
                                                       : "\"result\": \"converged\""));
        kempe_text_free(json);
        kempe_inverse_free(r);
        unlink(path);
    }
    unload(&m);
}

/* -- motions ----------------------------------------------------------------------------------------- */

/* Only the crank's angle is given, rows 1 ms apart that begin where the start is not: as the drive has it. */
static void one_coordinate_is_enough(void)
{
    char path[] = "/tmp/kempe_inverse_XXXXXX", text[64 * 1024];
    loaded m = load_four_bar(""), d = load_four_bar(driven);
    int length = snprintf(text, sizeof text, "t,q.a\n");
    double worst = 0, size = 0;
    for (int k = 200; k <= 1000; k++)
        length += snprintf(text + length, sizeof text - (size_t)length, "%.17g,%.17g\n", k / 1000.0,
                           M_PI / 2 + 5 * (k / 1000.0) + 2 * sin(3 * (k / 1000.0)));
    write_text(&m, path, text);
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.motion = path, .actuators = "a"}, KEMPE_OK);
    kempe_inverse *all = invert(&d, NULL, KEMPE_OK);
    CHECK(r && all && r->rows == 801);
    for (int row = 0; r && all && row < 801; row++) {
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(q_at(r, row)[k], q_at(all, 200 + row)[k], 1e-13);
        size = check_max(size, fabs(tau_at(all, 200 + row)[0]));
        if (row >= 10 && row < 791) /* at the ends splines know less */
            worst = check_max(worst, fabs(tau_at(r, row)[0] - tau_at(all, 200 + row)[0]));
    }
    CHECK(worst < 1e-8 * size);
    kempe_inverse_free(r);
    /* the drive stands in the table: it is left out */
    r = invert(&d, &(kempe_inverse_options){.motion = path, .actuators = "c", .output_step = 0.1}, KEMPE_OK);
    CHECK(r && r->rows == 9);
    for (int row = 0; r && all && row < 9; row++) {
        CHECK_NEAR(r->t[row], 0.2 + 0.1 * row, 1e-15);
        CHECK_NEAR(q_at(r, row)[2], q_at(all, 200 + 100 * row)[2], 1e-12);
        CHECK_NEAR(power_at(r, row)[0], power_at(all, 200 + 100 * row)[0], 1e-5);
    }
    kempe_inverse_free(r);
    kempe_inverse_free(all);
    unlink(path);
    unload(&m);
    unload(&d);
}

/* A table that says otherwise than the drive. */
static void a_table_goes_before_drives(void)
{
    char path[] = "/tmp/kempe_inverse_XXXXXX";
    loaded m = load_four_bar(""), d = load_four_bar(driven);
    write_text(&m, path, "t,q.a,qd.a,qdd.a\n0,1.6,2,3\n0.1,1.7,1,-3\n0.2,1.9,2,4\n");
    kempe_inverse *r[2] = {invert(&m, &(kempe_inverse_options){.motion = path, .actuators = "a"}, KEMPE_OK),
                           invert(&d, &(kempe_inverse_options){.motion = path}, KEMPE_OK)};
    for (int row = 0; r[0] && r[1] && row < 3; row++) {
        CHECK(q_at(r[1], row)[0] == q_at(r[0], row)[0]);
        CHECK_NEAR(tau_at(r[1], row)[0], tau_at(r[0], row)[0], 1e-13);
    }
    kempe_inverse_free(r[0]);
    kempe_inverse_free(r[1]);
    unlink(path);
    unload(&m);
    unload(&d);
}

/* Rows so far apart that the crank turns by more than half between them; that the rocker comes close to its dead
 * centre, where the branches meet, and goes back. */
static void the_branch_is_kept(void)
{
    static const char near_centre[] =
        "drives: {m: {joint: c, angle: \"acos(-0.09/1.26) + 4e-5 + 0.2*(1 + cos(4*t))\"}}\n";
    const char *const drives[] = {driven, near_centre};
    for (int d = 0; d < 2; d++) {
        loaded m = load_four_bar(drives[d]);
        kempe_inverse *far = invert(&m, &(kempe_inverse_options){.t_end = 10, .output_step = 0.7}, KEMPE_OK);
        kempe_inverse *near = invert(&m, &(kempe_inverse_options){.t_end = 10, .output_step = 0.001}, KEMPE_OK);
        CHECK(far && near && far->rows == 16);
        for (int row = 0; far && near && row < 15; row++)
            for (int k = 0; k < 3; k++)
                CHECK_NEAR(q_at(far, row)[k], q_at(near, 700 * row)[k], 1e-12);
        kempe_inverse_free(far);
        kempe_inverse_free(near);
        unload(&m);
    }
}

/* Positions of five digits, and sixteen redundant rows that are then no longer quite so. */
static void a_coarse_table_is_closed(void)
{
    char fine[] = "/tmp/kempe_inverse_XXXXXX", coarse[] = "/tmp/kempe_inverse_XXXXXX", text[64 * 1024];
    loaded m = load_here(in_space);
    double rounded[MOST] = {0};
    int kept[4] = {0};
    write_robot(&m, true, fine);
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.motion = fine, .actuators = "a1,b1"}, KEMPE_OK);
    int length = snprintf(text, sizeof text, "t");
    for (int k = 0; k < 3 * m.system->n; k++)
        length += snprintf(text + length, sizeof text - (size_t)length, ",%s.%s",
                           k < m.system->n       ? "q"
                           : k < 2 * m.system->n ? "qd"
                                                 : "qdd",
                           kempe_model_coordinate_name(m.model, k % m.system->n));
    for (int row = 0; r && row < r->rows; row++) {
        const double *of[] = {q_at(r, row), qd_at(r, row), qdd_at(r, row)};
        length += snprintf(text + length, sizeof text - (size_t)length, "\n%.17g", r->t[row]);
        for (int k = 0; k < 3 * m.system->n; k++) {
            int before = length;
            length += snprintf(text + length, sizeof text - (size_t)length, ",%.3f",
                               of[k / m.system->n][k % m.system->n] + (k == 1 ? 2e-3 : 0));
            if (row == 0 && k < m.system->n)
                rounded[k] = strtod(text + before + 1, NULL);
        }
    }
    write_text(&m, coarse, text);
    kempe_inverse *again = invert(&m, &(kempe_inverse_options){.motion = coarse, .actuators = "a1,b1"}, KEMPE_OK);
    CHECK(again && again->rows == 101 && kempe_inverse_dof(again) == 2);
    CHECK(again && kempe_inverse_residual(again) < 1e-13);
    for (int k = 0; again && k < m.system->n; k++)
        kept[k / 3] |= q_at(again, 0)[k] == rounded[k]; /* three that say the same */
    CHECK(kept[0] + kept[1] + kept[2] + kept[3] >= 2);  /* the independent ones */
    for (int row = 0; r && again && row < again->rows; row++)
        for (int k = 0; k < 2; k++)
            CHECK(fabs(tau_at(again, row)[k] - tau_at(r, row)[k]) < 0.4);
    kempe_inverse_free(r);
    kempe_inverse_free(again);
    unlink(fine);
    unlink(coarse);
    unload(&m);
}

/* A parallelogram along angle 0.3 + w t, level at t = 0 for angle = 0: rows from there on. */
static kempe_inverse *along_parallelogram(const loaded *m, double first, double *t_first)
{
    char path[] = "/tmp/kempe_inverse_XXXXXX", text[16 * 1024];
    int length = snprintf(text, sizeof text, "t,q.a,q.b,q.c,qd.a,qd.b,qd.c,qdd.a,qdd.b,qdd.c\n");
    for (int k = 0; k <= 50; k++) {
        double t = k * 0.02, x = first + t * (1 + t), v = 1 + 2 * t;
        length += snprintf(text + length, sizeof text - (size_t)length,
                           "%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,2,-2,2\n", t, x, -x, x, v, -v, v);
    }
    write_text(m, path, text);
    kempe_inverse *r = invert(m, &(kempe_inverse_options){.motion = path, .actuators = "a"}, KEMPE_OK);
    *t_first = r ? r->t[0] : NAN;
    unlink(path);
    return r;
}

/* A motion that begins where the mechanism has one freedom more: from the second row on there is one. By hand: cranks
 * of 1 kg and 0.01 kg m^2 with their centres half way, a coupler of 2 kg that goes round without turning. */
static void begins_at_a_change_point(void)
{
    loaded m =
        load_text("kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {D: [1, 0, 0]}}\n"
                  "bodies:\n"
                  "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [0.25, 0, 0], inertia: {zz: 0.01}, "
                  "points: {B: [0.5, 0, 0]}}\n"
                  "  b: {joint: {revolute: z, at: a.B}, mass: 2, com: [0.5, 0, 0], inertia: {zz: 0.2}, points: {C: "
                  "[1, 0, 0]}}\n"
                  "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [0.25, 0, 0], inertia: {zz: 0.01}, "
                  "points: {C: [0.5, 0, 0]}}\n"
                  "loops: {C: {ball: [b.C, c.C]}}\nstart: {q: {a: 1, b: -1, c: 1}}\n");
    double t;
    kempe_inverse *r = along_parallelogram(&m, 0, &t);
    char *json = NULL;
    const double inertia = 2 * (0.01 + 0.25 * 0.25) + 2 * 0.5 * 0.5, weight = 9.81 * (2 * 0.25 + 2 * 0.5);
    CHECK(r && r->rows == 51 && t == 0);
    CHECK(r && kempe_inverse_dof(r) == 1 && kempe_inverse_residual(r) < 1e-14);
    for (int row = 1; r && row < r->rows; row++)
        CHECK_NEAR(tau_at(r, row)[0], 2 * inertia + weight * cos(q_at(r, row)[0]), 1e-12);
    CHECK(r && kempe_inverse_print(r, KEMPE_JSON, &json) == KEMPE_OK);
    CHECK(json && strstr(json, "\"redundant\": []") && strstr(json, "\"singular\": 1"));
    kempe_text_free(json);
    for (int flat = 25; flat <= 50; flat += 25) { /* on the way, at its end */
        kempe_inverse *through = along_parallelogram(&m, flat == 25 ? -0.75 : -2, &t);
        CHECK(through && q_at(through, flat)[0] == 0 && kempe_inverse_dof(through) == 1);
        for (int row = 0; through && row < through->rows; row++)
            if (row != flat)
                CHECK_NEAR(tau_at(through, row)[0], 2 * inertia + weight * cos(q_at(through, row)[0]), 1e-12);
        kempe_inverse_free(through);
    }
    kempe_inverse_free(r);
    unload(&m);
}

/* Torque that holds the mechanism at rest: virtual work of gravity and spring along the crank, by differences of the
 * energy.
 */
static void the_start_is_held(void)
{
    loaded m = load_four_bar("");
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.actuators = "a"}, KEMPE_OK);
    CHECK(r && r->rows == 1);
    kempe_workspace *ws = NULL;
    CHECK(kempe_workspace_new(m.system, &ws) == KEMPE_OK);
    double energy[2], q[3];
    const int hold[3] = {1, 0, 0};
    for (int side = 0; r && side < 2; side++) {
        memcpy(q, q_at(r, 0), sizeof q);
        q[0] += side ? 1e-5 : -1e-5;
        CHECK(kempe_workspace_close(ws, 0, q, NULL, hold) == KEMPE_OK &&
              kempe_workspace_evaluate(ws, 0, q, NULL) == KEMPE_OK);
        energy[side] = kempe_workspace_potential(ws);
    }
    CHECK_NEAR(tau_at(r, 0)[0], (energy[1] - energy[0]) / 2e-5, 1e-8);
    kempe_workspace_free(ws);
    kempe_inverse_free(r);
    unload(&m);
}

/* The rocker of this four-bar cannot go round: rows up to where it could. */
static void out_of_reach(void)
{
    loaded m = load_four_bar("drives: {m: {joint: c, angle: \"1.85 + t\"}}\n");
    kempe_inverse *r = invert(&m, &(kempe_inverse_options){.output_step = 0.01}, KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(m.context), "beyond t = 0.7059"));
    int rows = r ? r->rows : 0;
    CHECK(rows > 10 && rows < 100);
    kempe_inverse_free(r);
    unload(&m);
}

int main(void)
{
    TEST(a_motion_of_points);
    TEST(accelerations_of_fourth_order);
    TEST(one_coordinate_is_enough);
    TEST(tables_too_coarse_are_reported);
    TEST(a_table_goes_before_drives);
    TEST(the_branch_is_kept);
    TEST(a_coarse_table_is_closed);
    TEST(begins_at_a_change_point);
    TEST(the_start_is_held);
    TEST(out_of_reach);
    return check_report();
}
