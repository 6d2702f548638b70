/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions in what a run shows: each row has them at its own state, whatever they depend on, and those that no
 * equation of motion has are no events. */
#include "evaluated.h"

enum { SENSORS = 14, FORCES = 2, MOST = SENSORS + FORCES };

/* A pendulum that swings, or is driven. */
#define SCENE(start, forces, drive)                                                                                    \
    "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                      \
    "  b: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [1, 0, 0], inertia: {zz: 1}}\n"                    \
    "algebraic: {w: \"if(qd(A) < 0, -10, 10)\", v: {of: {vv: 0.1}, zero: \"vv - if(qd(A) < 0, -5, 5)\"}}\n"            \
    "sensors:\n  sign_qd: \"sign(qd(A))\"\n  sign_q: \"sign(q(A))\"\n  less: \"if(qd(A) < 0.1, 1, 2)\"\n"              \
    "  most: \"if(qd(A) <= 0.1, 1, 2)\"\n  greater: \"if(q(A) > 0.1, qd(A), -qd(A))\"\n  big: \"max(qd(A), 0)\"\n"     \
    "  small: \"min(qd(A), 0.2)\"\n  size: \"abs(qd(A))\"\n  late: \"if(t < 0.1, 1, 2)\"\n"                            \
    "  within: \"if(sign(qd(A))*q(A) < 0, 1, 2)\"\n  named: w\n  solved: vv\n  whole: floor(q(A)/0.3)\n  turned: "     \
    "\"wrap(q(A), 0.7)\"\n" forces start drive                                                                         \
    "run: {t_end: 2, output_step: 0.02, outputs: [sign_qd, sign_q, less, most, greater, big, small, size, late, "      \
    "within, "                                                                                                         \
    "named, solved, whole, turned%s]}\n"

static int expect(double t, double q, double qd, double *x)
{
    const double sign_qd = qd < 0 ? -1 : 1;
    const double all[SENSORS] = {sign_qd,
                                 q < 0 ? -1 : 1,
                                 qd < 0.1 ? 1 : 2,
                                 qd <= 0.1 ? 1 : 2,
                                 q > 0.1 ? qd : -qd,
                                 fmax(qd, 0),
                                 fmin(qd, 0.2),
                                 fabs(qd),
                                 t < 0.1 ? 1 : 2,
                                 sign_qd * q < 0 ? 1 : 2,
                                 10 * sign_qd,
                                 5 * sign_qd,
                                 floor(q / 0.3),
                                 q - 0.7 * floor(q / 0.7 + 0.5)};
    memcpy(x, all, sizeof all);
    return SENSORS;
}

static void check_close(int count, const double *a, const double *b, double tolerance)
{
    for (int k = 0; k < count; k++)
        CHECK_NEAR(a[k], b[k], tolerance);
}

/* Every row of a run against its own state; how many signs of the rate there were. */
static int check_rows(const loaded *l, kempe_run_options run, bool forces)
{
    bool seen[2] = {false, false};
    evaluated e = evaluate(l, &run, KEMPE_OK);
    for (int row = 0; row < e.rows; row++) {
        double q = kempe_trajectory_q(e.run, row)[0], qd = kempe_trajectory_qd(e.run, row)[0], x[MOST];
        int count = expect(kempe_trajectory_time(e.run, row), q, qd, x);
        if (forces) {
            x[count++] = qd < 0 ? -1 : 1;
            x[count++] = qd < 0 ? 0.1 : -0.1;
        }
        seen[qd < 0] = true;
        check_close(count, shown_at(&e, row), x, 1e-12);
    }
    release(&e);
    return seen[0] + seen[1];
}

static void each_row_has_its_own_state(void)
{
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    static const char *const texts[] = {
        SCENE("start: {q: {A: -1.5}, qd: {A: 0.2}}\n", "", ""),
        SCENE("", "", "drives: {D: {joint: A, angle: \"sin(9*t)/3\"}}\n"),
        SCENE("start: {q: {A: -1.5}, qd: {A: 0.2}}\n",
              "forces: {f: {joint: A, torque: \"w/10 + 0*vv\"}, g: {joint: A, torque: \"if(qd(A) < 0, 0.1, -0.1)\"}}\n",
              "")};

    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
        for (size_t r = 0; r < sizeof formulations / sizeof *formulations; r++) {
            char text[4096];
            kempe_run_options run = {0};
            run.formulation = formulations[r];
            run.integrator = independent_integrator(formulations[r]);
            (void)snprintf(text, sizeof text, texts[k], k == 2 ? ", force(f), force(g)" : "");
            loaded l = load_text(text);
            CHECK(l.system && check_rows(&l, run, k == 2) == 2);
            unload(&l);
        }
}

static int conditions(const char *form, const char *more)
{
    char text[4096];
    (void)snprintf(text, sizeof text, form, more);
    loaded l = load_text(text);
    int count = l.system ? l.system->events.count : -1;
    unload(&l);
    return count;
}

static void outputs_alone_make_no_event(void)
{
    CHECK(conditions(SCENE("", "", ""), "") == 0);
    CHECK(conditions(SCENE("", "forces: {f: {joint: A, torque: \"w/10\"}}\n", ""), "") == 1);
}

/* A condition of the multiplier of a driven joint, which changes sign with cos A. */
static void multipliers_decide(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                         "  b: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [1, 0, 0], inertia: {zz: 1}}\n"
                         "sensors: {held: \"if(lambda(D) > 0, 1, 0)\", slow: \"if(qd(A) < -1, 1, 0)\"}\n"
                         "drives: {D: {joint: A, angle: \"4*sin(t)\"}}\n"
                         "run: {t_end: 3, output_step: 0.05, outputs: [held, slow]}\n");
    kempe_run_options run = {0};
    int sum[2] = {0, 0};
    evaluated e = evaluate(&l, &run, KEMPE_OK);
    for (int row = 0; row < e.rows; row++) {
        double x[2] = {kempe_trajectory_lambda(e.run, row)[0] > 0, kempe_trajectory_qd(e.run, row)[0] < -1};
        check_close(2, shown_at(&e, row), x, 0);
        sum[0] += x[0] > 0;
        sum[1] += x[1] > 0;
    }
    CHECK(sum[0] > 5 && sum[0] < e.rows - 5 && sum[1] > 5 && sum[1] < e.rows - 5);
    release(&e);
    unload(&l);
}

int main(void)
{
    TEST(each_row_has_its_own_state);
    TEST(outputs_alone_make_no_event);
    TEST(multipliers_decide);
    return check_report();
}
