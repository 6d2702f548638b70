/* SPDX-License-Identifier: BSD-3-Clause */
/* Studies of models with states against closed forms: equilibrium, state space, eigenvalues, frequency response,
 * sensitivities, ensembles, diagnosis, states of a stepper. */
#include "instances.h"
#include "loaded.h"
#include <complex.h>
#include <kempe/check.h>
#include <kempe/equilibrium.h>
#include <kempe/kinematics.h>
#include <kempe/linearize.h>
#include <kempe/modes.h>
#include <kempe/response.h>
#include <kempe/sensitivity.h>
#include <kempe/stepper.h>

/* A direct-current motor against a torsional spring. */
#define MOTOR                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {R: 2, L: 5e-3, K: 0.1, J: 1e-3, b: 1e-4, U: 12, k: %s, i0: 1}\n"                                     \
    "states: {i: {start: i0, rate: (U - R*i - K*qd(A))/L}}\n"                                                          \
    "bodies: {rotor: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: J}}}\n"                        \
    "forces: {torque: {joint: A, torque: K*i - b*qd(A)}, spring: {joint: A, spring: {stiffness: k}}}\n"                \
    "run: {t_end: 0.1, rtol: 1e-11, atol: 1e-11, outputs: [q, qd, i]}\n"

static const double R = 2, L = 5e-3, K = 0.1, J = 1e-3, B = 1e-4, U = 12, STIFF = 0.5;

static loaded load_motor(const char *stiffness)
{
    char text[1024];
    (void)snprintf(text, sizeof text, MOTOR, stiffness);
    return load_text(text);
}

static double entry(const kempe_table *table, int row, const char *column)
{
    int k = kempe_table_find(table, column);
    return k < 0 || row >= kempe_table_row_count(table) ? NAN : kempe_table_number(table, row, k);
}

/* det(s^2 J + s b + k, -K; K s / L, s + R / L) of angle and current. */
static double complex characteristic(double complex s, double stiffness)
{
    return (s * s * J + s * B + stiffness) * (s + R / L) + K * K * s / L;
}

static void equilibrium(void)
{
    loaded l = load_motor("0.5");
    kempe_equilibrium *e = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    CHECK(kempe_equilibrium_count(e) == 1);
    CHECK_TEXT(kempe_equilibrium_stability(e, 0), "stable");
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    CHECK_NEAR(entry(table, 0, "q.A"), K * U / R / STIFF, 1e-12);
    CHECK_NEAR(entry(table, 0, "state.i"), U / R, 1e-12);
    CHECK(kempe_table_find(table, "qd.i") < 0 && kempe_table_find(table, "q.i") < 0);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* Pressures of 10 MPa with rates of TPa/s beside valves of the size 1. At rest each integral has made its error zero,
 * so that the arms are at their targets, the valve follows its command, and a nearly closed valve, whose edges are
 * alike, halves the supply between both chambers: the sum of their pressures is the supply. */
static void equilibrium_of_hydraulics(void)
{
    static const char *const arms[] = {"boom", "stick", "bucket"};
    static const double degrees[] = {25, -95, -60};
    loaded l = load("examples/hydraulic_excavator/hydraulic_excavator.yaml");
    kempe_equilibrium *e = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    for (int k = 0; k < 3; k++) {
        double at[5];
        static const char *const of[] = {"q.%s", "state.%s_command", "state.%s_valve", "state.%s_a", "state.%s_b"};
        for (int i = 0; i < 5; i++) {
            char column[64];
            (void)snprintf(column, sizeof column, of[i], arms[k]);
            at[i] = entry(table, 0, column);
        }
        CHECK_NEAR(at[0], degrees[k] * acos(-1) / 180, 1e-12);
        CHECK_NEAR(at[2] / at[1], 1, 1e-9);
        CHECK_NEAR((at[3] + at[4]) / 22e6, 1, 1e-12);
    }
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    kempe_linearization *space = NULL;
    CHECK(l.system && kempe_linearization_new(l.system, NULL, &space) == KEMPE_OK);
    CHECK(kempe_linearization_is_equilibrium(space));
    kempe_linearization_free(space);
    unload(&l);
}

/* Steady motion of the motor: where nothing holds the rotor, it turns steadily, with the current of that speed. */
static void steady_motion(void)
{
    loaded l = load_motor("0");
    kempe_equilibrium *e = NULL;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(e && kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
    double speed = K * U / R / (B + K * K / R);
    CHECK_NEAR(entry(table, 0, "qd.A"), speed, 1e-9);
    CHECK_NEAR(entry(table, 0, "state.i"), (U - K * speed) / R, 1e-9);
    kempe_table_free(table);
    kempe_equilibrium_free(e);
    unload(&l);
}

static void state_space(void)
{
    static const char *const names[] = {"q.A", "qd.A", "state.i"};
    const double a[9] = {0, -STIFF / J, 0, 1, -B / J, -K / L, 0, K / J, -R / L}, b[3] = {0, 0, 1 / L};
    loaded l = load_motor("0.5");
    kempe_linearization *x = NULL;
    kempe_linearize_options options = {.inputs = "U", .outputs = "i,qd(A)"};
    int rows = 0, columns = 0;
    CHECK(l.system && kempe_linearization_new(l.system, &options, &x) == KEMPE_OK);
    CHECK(kempe_linearization_count(x, KEMPE_CHANNEL_STATE) == 3);
    for (int k = 0; k < 3; k++)
        CHECK_TEXT(kempe_linearization_name(x, KEMPE_CHANNEL_STATE, k), names[k]);
    const double *of_a = kempe_linearization_matrix(x, KEMPE_MATRIX_A, &rows, &columns);
    CHECK(of_a && rows == 3 && columns == 3);
    for (int k = 0; of_a && k < 9; k++)
        CHECK_NEAR(of_a[k], a[k], 1e-13);
    const double *of_b = kempe_linearization_matrix(x, KEMPE_MATRIX_B, &rows, &columns);
    CHECK(of_b && rows == 3 && columns == 1);
    for (int k = 0; of_b && k < 3; k++)
        CHECK_NEAR(of_b[k], b[k], 1e-13);
    const double *of_c = kempe_linearization_matrix(x, KEMPE_MATRIX_C, &rows, &columns);
    CHECK(of_c && rows == 2 && columns == 3 && of_c[4] == 1 && of_c[3] == 1 - of_c[2] && of_c[0] == 0);
    kempe_linearization_free(x);
    unload(&l);
}

/* -- a hydraulic servo ------------------------------------------------------------------------------- */

/* A load on a spring, which a cylinder moves: a valve feeds it through an orifice, and it leaks to the tank. Its volume
 * grows with the piston. */
#define SERVO                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {beta: 1.2 GPa, area: 2e-3, m: 200, c: 800, k: 5e5, supply: 14 MPa, gain: 4e-8, u: 0.5, leak: "       \
    "1e-11}\n"                                                                                                         \
    "states: {p: {start: 5 MPa, rate: beta/(1e-3 + area*q(x))*(gain*u*sqrt(supply - p) - leak*p - area*qd(x))}}\n"     \
    "bodies: {load: {joint: {name: x, prismatic: x, at: ground}, mass: m}}\n"                                          \
    "forces: {oil: {joint: x, force: p*area - c*qd(x)}, spring: {joint: x, spring: {stiffness: k}}}\n"

static const double beta = 1.2e9, area = 2e-3, load_mass = 200, damper = 800, spring = 5e5, supply = 14e6, gain = 4e-8,
                    opening = 0.5, leak = 1e-11;

/* gain u sqrt(supply - p) = leak p is a quadratic equation of the root's value. */
static double rest_pressure(void)
{
    double flow = gain * opening / leak, root = (sqrt(flow * flow + 4 * supply) - flow) / 2;
    return supply - root * root;
}

/* det(s - A) of x, x' and p at rest, with the volume there. */
static double complex servo_polynomial(double complex s, double p)
{
    double stiffness = beta / (1e-3 + area * p * area / spring), root = sqrt(supply - p);
    double damping = stiffness * (gain * opening / (2 * root) + leak);
    return (s * s * load_mass + s * damper + spring) * (s + damping) + stiffness * area * area * s;
}

/* State space and frequency response of the position by the valve at rest against the closed form. The pressure does
 * not depend on the place, whose volume multiplies flows that cancel up to rounding. */
static void hydraulic_servo(void)
{
    loaded l = load_text(SERVO);
    kempe_linearization *x = NULL;
    kempe_linearize_options options = {.inputs = "u", .outputs = "q(x)", .at = "equilibrium"};
    int rows = 0, columns = 0;
    double p = rest_pressure(), stiffness = beta / (1e-3 + area * p * area / spring), root = sqrt(supply - p);
    const double a[9] = {0,
                         1,
                         0,
                         -spring / load_mass,
                         -damper / load_mass,
                         area / load_mass,
                         0,
                         -stiffness * area,
                         -stiffness * (gain * opening / (2 * root) + leak)};
    CHECK(l.system && kempe_linearization_new(l.system, &options, &x) == KEMPE_OK);
    const double *of_a = kempe_linearization_matrix(x, KEMPE_MATRIX_A, &rows, &columns);
    CHECK(of_a && rows == 3 && columns == 3);
    for (int i = 0; of_a && i < 9; i++)
        CHECK(fabs(of_a[i] - a[i % 3 * 3 + i / 3]) <=
              1e-11 * fabs(a[i % 3 * 3 + i / 3]) + (i == 2 ? 1e-15 * stiffness * area : 0));
    const double *of_b = kempe_linearization_matrix(x, KEMPE_MATRIX_B, &rows, &columns);
    CHECK(of_b && of_b[0] == 0 && of_b[1] == 0);
    CHECK_NEAR(of_b ? of_b[2] : NAN, stiffness * gain * root, 1e-11);
    kempe_linearization_free(x);
    kempe_response *r = NULL;
    kempe_response_options asked = {.inputs = "u", .outputs = "q(x)", .frequencies = "0.5:100:9"};
    CHECK(l.system && kempe_response_new(l.system, &asked, &r) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(r && kempe_response_table(r, "rows", &table) == KEMPE_OK);
    for (int i = 0; i < kempe_table_row_count(table); i++) {
        double complex s = 2 * acos(-1) * entry(table, i, "frequency") * I;
        double complex wanted = area * stiffness * gain * root / servo_polynomial(s, p);
        double phase = acos(-1) / 180 * entry(table, i, "q.x/u.phase");
        double complex found = entry(table, i, "q.x/u.amplitude") * cexp(phase * I);
        CHECK(cabs(found - wanted) <= 1e-11 * cabs(wanted));
    }
    CHECK(kempe_table_row_count(table) == 9);
    kempe_table_free(table);
    kempe_response_free(r);
    unload(&l);
}

/* Every eigenvalue is a root of the characteristic polynomial, of which there are as many as its degree. */
static void eigenvalues(void)
{
    static const char *const stiffness[] = {"0.5", "0"};
    static const double value[] = {0.5, 0};
    for (int c = 0; c < 2; c++) {
        loaded l = load_motor(stiffness[c]);
        kempe_modes *m = NULL;
        kempe_modes_options options = {.at = "start"};
        CHECK(l.system && kempe_modes_new(l.system, &options, &m) == KEMPE_OK);
        kempe_table *table = NULL;
        CHECK(m && kempe_modes_table(m, "modes", &table) == KEMPE_OK);
        CHECK(kempe_table_row_count(table) == 3);
        double complex product = 1;
        for (int k = 0; k < kempe_table_row_count(table); k++) {
            double complex s = entry(table, k, "re") + entry(table, k, "im") * I;
            double size = cabs(s * s * J) * (cabs(s) + R / L) + value[c] * R / L;
            CHECK(cabs(characteristic(s, value[c])) <= 1e-11 * size);
            product *= s;
        }
        CHECK_NEAR(creal(product), -value[c] * R / L / J, 1e-11);
        kempe_table_free(table);
        kempe_modes_free(m);
        unload(&l);
    }
}

/* Current by voltage: (s^2 J + s b + k) / L over the characteristic polynomial; also at rest. */
static void response(void)
{
    loaded l = load_motor("0.5");
    kempe_response *x = NULL;
    kempe_response_options options = {.inputs = "U", .outputs = "i", .frequencies = "0.1:100:5"};
    CHECK(l.system && kempe_response_new(l.system, &options, &x) == KEMPE_OK);
    kempe_table *table = NULL;
    CHECK(x && kempe_response_table(x, "rows", &table) == KEMPE_OK);
    for (int k = 0; k < kempe_table_row_count(table); k++) {
        double complex s = 2 * acos(-1) * entry(table, k, "frequency") * I;
        double complex wanted = (s * s * J + s * B + STIFF) / L / characteristic(s, STIFF);
        double phase = acos(-1) / 180 * entry(table, k, "state.i/U.phase");
        double complex found = entry(table, k, "state.i/U.amplitude") * cexp(phase * I);
        CHECK(cabs(found - wanted) <= 1e-12 * cabs(wanted));
    }
    CHECK(kempe_table_row_count(table) == 5);
    kempe_table_free(table);
    kempe_response_free(x);
    unload(&l);
}

/* A lag: y = 1 + (y0 - 1) e^(-t/T), by T and by its start. */
static void sensitivity(void)
{
    static const char *const methods[] = {"forward", "adjoint"};
    loaded l =
        load_text("kempe: 1\nparameters: {T: 0.2, y0: 0.25}\nstates: {y: {start: y0, rate: (1 - y)/T, scale: 1}}\n"
                  "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                  "run: {t_end: 1, rtol: 1e-11, atol: 1e-11, outputs: [y]}\n");
    for (int k = 0; k < 2; k++) {
        kempe_sensitivity *s = NULL;
        kempe_table *rows = NULL;
        kempe_sensitivity_options options = {.parameters = k ? "T,state.y" : "T,y0", .method = methods[k]};
        CHECK(l.model && kempe_sensitivity_new(l.model, &options, &s) == KEMPE_OK);
        CHECK(s && kempe_sensitivity_table(s, "rows", &rows) == KEMPE_OK);
        int last = kempe_table_row_count(rows) - 1;
        CHECK_NEAR(kempe_table_number(rows, last, kempe_table_find(rows, "state.y")), 1 - 0.75 * exp(-5), 1e-9);
        CHECK_NEAR(kempe_table_number(rows, last, kempe_table_find(rows, "state.y/T")), -0.75 * exp(-5) / 0.04, 1e-8);
        CHECK_NEAR(kempe_table_number(rows, last, kempe_table_find(rows, k ? "state.y/state.y" : "state.y/y0")),
                   exp(-5), 1e-8);
        kempe_table_free(rows);
        kempe_sensitivity_free(s);
    }
    unload(&l);
}

/* Instances in lanes and alone, with other time constants and starts. */
static void ensemble(void)
{
    static const char *const names[] = {"T", "state.y"};
    static const double rows[] = {0.1, 0, 0.2, 0.5, 0.4, -1, 0.8, 2, 1.6, 0.25};
    loaded l = load_text("kempe: 1\nparameters: {T: 0.2}\nstates: {y: {rate: (1 - y)/T, scale: 1}}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                         "forces: {push: {joint: x, force: y}}\nrun: {t_end: 1, rtol: 1e-11, atol: 1e-11}\n");
    for (int lanes = -1; lanes < 1; lanes++) {
        instances all = run_instances(&l, lanes, 2, names, 5, rows);
        for (int k = 0; k < 5; k++) {
            double T = rows[2 * k], from = rows[2 * k + 1] - 1, at = exp(-1 / T);
            CHECK_NEAR(end_rate(&all, k, 1), 1 + from * at, 1e-9);
            CHECK_NEAR(end_rate(&all, k, 0), 1 + from * T * (1 - at), 1e-9);
        }
        free_instances(&all);
    }
    unload(&l);
}

/* A state that is set, saved, restored; the continued run is the same to the last bit. */
static void stepper(void)
{
    loaded l = load_motor("0.5");
    kempe_stepper *s = NULL;
    kempe_stepper_state *kept = NULL;
    CHECK(l.system && kempe_stepper_new(l.system, NULL, &s) == KEMPE_OK);
    const double q[2] = {0.1, 0}, qd[2] = {-1, 2.5};
    double moved = NAN, end[2] = {0};
    CHECK(s && kempe_stepper_set_state(s, q, qd, &moved) == KEMPE_OK);
    CHECK(s && kempe_stepper_qd(s)[1] == 2.5 && kempe_stepper_qdd(s) != NULL);
    CHECK_NEAR(kempe_stepper_qdd(s)[1], (U - R * 2.5 + K) / L, 1e-12);
    CHECK(kempe_stepper_advance(s, 0.01) == KEMPE_OK && kempe_stepper_save(s, &kept) == KEMPE_OK);
    CHECK(kempe_stepper_advance(s, 0.02) == KEMPE_OK);
    memcpy(end, kempe_stepper_qd(s), sizeof end);
    CHECK(kempe_stepper_restore(s, kept) == KEMPE_OK && kempe_stepper_advance(s, 0.02) == KEMPE_OK);
    CHECK(memcmp(end, kempe_stepper_qd(s), sizeof end) == 0);
    kempe_stepper_state_free(kept);
    kempe_stepper_free(s);
    unload(&l);
}

/* A crank that turns by 1 rad with a rod of length 2 to a slider: x = cos A + sqrt(4 - sin^2 A). States change nothing
 * of it and keep their start values; they are no degrees of freedom. */
static void positions(void)
{
    loaded l = load_text(
        "kempe: 1\n"
        "ground: {points: {O: [0, 0, 0]}}\n"
        "states: {p: {start: 3, rate: 1 - p}, n: {sample: 0.1, next: n + 1}}\n"
        "bodies:\n"
        "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {C: [1, 0, 0]}}\n"
        "  slider: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {S: [0, 0, 0]}}\n"
        "loops: {rod: {rod: [crank.C, slider.S], length: 2}}\n"
        "forces: {push: {joint: x, force: p}}\n"
        "sensors: {twice: 2*p}\n"
        "start: {q: {A: 0.5, x: 2.5}}\n"
        "run: {t_end: 1, outputs: [twice]}\n");
    kempe_kinematics *k = NULL;
    kempe_table *table = NULL;
    const kempe_kinematics_options asked = {.sweep = "A=0.5:1.5:6"};
    CHECK(l.system && kempe_kinematics_new(l.system, &asked, &k) == KEMPE_OK);
    CHECK(k && kempe_kinematics_table(k, "rows", &table) == KEMPE_OK);
    CHECK(table && kempe_table_row_count(table) == 6);
    for (int row = 0; table && row < 6; row++) {
        double a = 0.5 + 0.2 * row, root = sqrt(4 - sin(a) * sin(a));
        CHECK_NEAR(entry(table, row, "q.x"), cos(a) + root, 1e-11);
        CHECK_NEAR(entry(table, row, "qd.x"), -sin(a) - sin(a) * cos(a) / root, 1e-11);
        CHECK(entry(table, row, "state.p") == 3 && entry(table, row, "sensor.twice") == 6);
    }
    kempe_table_free(table);
    kempe_kinematics_free(k);
    k = NULL;
    const kempe_kinematics_options many = {.sweep = "A=0.5:1.5:6,x=1:2"};
    CHECK(l.system && kempe_kinematics_new(l.system, &many, &k) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(l.context), "has 1 degree of freedom"));
    unload(&l);
}

/* The diagnosis is that of the mechanism, with requested coordinates too. */
static void check(void)
{
    char *text = NULL;
    loaded l = load_motor("0.5");
    kempe_check *c = NULL;
    CHECK(l.system && kempe_check_new(l.system, &c) == KEMPE_OK);
    CHECK(c && kempe_check_print(c, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(check_says(text, "can be simulated, 1 degree of freedom\n") &&
          check_says(text, "independent coordinate A\n"));
    kempe_text_free(text);
    kempe_check_free(c);
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {.independent = "A"};
    CHECK(kempe_simulate(l.system, &run, &trajectory) == KEMPE_OK);
    kempe_trajectory_free(trajectory);
    unload(&l);
}

int main(void)
{
    TEST(equilibrium);
    TEST(equilibrium_of_hydraulics);
    TEST(steady_motion);
    TEST(state_space);
    TEST(hydraulic_servo);
    TEST(eigenvalues);
    TEST(response);
    TEST(sensitivity);
    TEST(ensemble);
    TEST(stepper);
    TEST(positions);
    TEST(check);
    return check_report();
}
