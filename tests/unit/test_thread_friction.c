/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction in the thread of a screw: the torque F r tan(gamma + rho) raises a load and F r tan(rho - gamma) lowers it,
 * for loads of both signs and threads of both hands; a jack holds its load; motion down under its own load has the
 * acceleration of the closed form. */
#include "closed_form.h"
#include "ways.h"
#include <kempe/check.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

/* A spindle of 400 kg that turns and moves along z, with the torque of a motor and an axial force on it. */
#define SCREW                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "bodies:\n"                                                                                                        \
    "  s: {joint: {name: J, screw: z, pitch: %.17g, at: ground}, mass: 400, inertia: {zz: 0.05}}\n"                    \
    "forces:\n"                                                                                                        \
    "  load: {joint: J.1, force: %.17g}\n"                                                                             \
    "  motor: {joint: J.2, torque: %.17g}\n"                                                                           \
    "  rub: {joint: J.2, friction: {mu: %.17g, radius: 11 mm%s}}\n"                                                    \
    "start: {qd: {J.2: %.17g}}\n"                                                                                      \
    "run: {output_step: 0.1}\n"

static const double radius = 0.011, mass = 400, inertia = 0.05;

static loaded screw(double pitch, double load, double torque, double mu, const char *more, double rate)
{
    char text[1000];
    (void)snprintf(text, sizeof text, SCREW, pitch, load, torque, mu, more, rate);
    return load_text(text);
}

/* -- thresholds ------------------------------------------------------------------------------------------------ */

/* It turns from rest under a torque in a direction, or stays (0), by every way. */
static void turns(double pitch, double load, double torque, int direction, const char *more, double mu)
{
    loaded l = screw(pitch, load, torque, mu, more, 0);
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 0.2);
        if (run && direction == 0)
            CHECK(fabs(last_qd(run)[1]) < 1e-30 && fabs(last_q(run)[1]) < 1e-30); /* 0 but for the zeros of IDA */
        else if (run)
            CHECK(direction * last_qd(run)[1] > 0);
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* The torque on the rotation against the load, and along it, each a little less and a little more than the limits. A
 * load along -z is held by a multiplier along +z; a positive rotation of a right-handed thread raises it. */
static void thresholds_of(double pitch, double load, double flank, double mu)
{
    const double gamma = atan(fabs(pitch) / (2 * pi * radius)), rho = atan(mu / cos(flank)), size = fabs(load);
    const double raise = size * radius * tan(gamma + rho), lower = size * radius * tan(rho - gamma);
    const double up = (load < 0 ? 1 : -1) * (pitch > 0 ? 1 : -1); /* the rotation that raises */
    char more[60];
    (void)snprintf(more, sizeof more, ", flank: %.17g", flank);
    turns(pitch, load, up * raise * (1 - 1e-6), 0, more, mu);
    turns(pitch, load, up * raise * (1 + 1e-6), (int)up, more, mu);
    turns(pitch, load, -up * (lower - 1e-6 * raise), 0, more, mu);
    turns(pitch, load, -up * (lower + 1e-6 * raise), -(int)up, more, mu);
}

static void thresholds(void)
{
    thresholds_of(0.005, -4000, 15 * pi / 180, 0.12);  /* self-locking */
    thresholds_of(-0.005, -4000, 15 * pi / 180, 0.12); /* left-handed */
    thresholds_of(0.005, 3000, 0, 0.12);               /* the load pulls the other way */
    thresholds_of(-0.005, 3000, 30 * pi / 180, 0.12);
    thresholds_of(0.02, -4000, 15 * pi / 180, 0.05); /* must be held back */
}

/* With a coefficient of its own at rest it begins later. */
static void begins_later_by_the_static_coefficient(void)
{
    const double gamma = atan(0.005 / (2 * pi * radius)), rho = atan(0.2), raise = 4000 * radius * tan(gamma + rho);
    turns(0.005, -4000, raise * (1 - 1e-6), 0, ", mu_static: 0.2", 0.1);
    turns(0.005, -4000, raise * (1 + 1e-6), 1, ", mu_static: 0.2", 0.1);
}

/* -- motion -------------------------------------------------------------------------------------------------------- */

/* F = L + m k phi'' with k = pitch/(2 pi), and I phi'' = M - F k -+ (level of F): with the torque of the closed form,
 * I phi'' = M - F r tan(gamma + rho) upwards and I phi'' = M + F r tan(rho - gamma) downwards. */
static double acceleration(double pitch, double load, double torque, double mu, bool up)
{
    const double k = pitch / (2 * pi), gamma = atan(k / radius), rho = atan(mu);
    const double per_force = up ? -radius * tan(gamma + rho) : radius * tan(rho - gamma);
    return (torque - load * per_force) / (inertia - mass * k * per_force);
}

static void moves(double pitch, double load, double torque, double mu, double rate, double t_end)
{
    loaded l = screw(pitch, load, torque, mu, "", rate);
    const double a = acceleration(pitch, load, torque, mu, rate > 0);
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], t_end);
        if (run) {
            CHECK_NEAR(last_qd(run)[1], rate + a * t_end, 10 * ways[k].tolerance);
            CHECK_NEAR(last_q(run)[1], rate * t_end + a * t_end * t_end / 2, 10 * ways[k].tolerance);
            CHECK_NEAR(last_lambda(run)[0] / fabs(load), (mass * pitch / (2 * pi) * a - load) / fabs(load), 1e-9);
            CHECK(run->verdict.drift_rel < 1e-6);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

static void motion_with_friction(void)
{
    moves(0.02, -4000, 0, 0.05, -1e-3, 0.5); /* down under its own load */
    moves(0.005, -4000, 0, 0.12, 20, 0.05);  /* coasts upwards */
    moves(0.005, -4000, -10, 0.12, -5, 0.3); /* driven down against the friction of a self-locking thread */
    moves(0.005, -4000, 20, 0.12, 3, 0.3);   /* driven up */
    moves(0.02, -4000, 0.5, 0.05, -10, 0.3); /* lowered against a brake */
}

/* -- instances and derivatives ------------------------------------------------------------------------- */

/* Down under its own load. */
static void lowered(double mu, double end[2])
{
    const double a = acceleration(0.02, -4000, 0, mu, false), t = 0.5;
    end[0] = -1e-3 * t + a * t * t / 2;
    end[1] = -1e-3 + a * t;
}

static void instances_and_derivatives(void)
{
    const char *text =
        "kempe: 1\nparameters: {mu: 0.05}\n"
        "bodies: {s: {joint: {name: J, screw: z, pitch: 0.02, at: ground}, mass: 400, inertia: {zz: 0.05}}}\n"
        "forces: {load: {joint: J.1, force: -4000}, rub: {joint: J.2, friction: {mu: mu, radius: 11 mm}}}\n"
        "start: {qd: {J.2: -1e-3}}\nrun: {t_end: 0.5, rtol: 1e-11}\n";
    instances_are(text, "mu", 0.05, 1, lowered, 1e-9);
    slopes_are(text, "forward", "q(J.2),qd(J.2)", 0.05, 0.5, lowered, 1e-9);
}

/* -- a jack ------------------------------------------------------------------------------------------------------ */

/* A nut that a guide keeps from turning, on a spindle with a bearing. The motor stops, the nut stays. */
static void jack_holds_its_load(void)
{
    loaded l =
        load_text("kempe: 1\n"
                  "gravity: [0, 0, -9.81]\n"
                  "ground: {points: {B: [0, 0, 0], G: [0.1, 0, 0]}}\n"
                  "bodies:\n"
                  "  spindle: {joint: {name: S, revolute: z, at: ground.B}, mass: 5, inertia: {zz: 0.01}, points: "
                  "{T: [0, 0, 0]}}\n"
                  "  nut: {joint: {name: N, screw: z, pitch: 5 mm, at: spindle.T}, mass: 600, inertia: {zz: 2}, "
                  "points: {G: [0.1, 0, 0]}}\n"
                  "loops: {guide: {constraint: \"q(S) + q(N.2)\", power: 0}}\n"
                  "forces:\n"
                  "  motor: {joint: S, torque: \"if(t < 0.5, 20, 0) - 0.02*qd(S)\"}\n"
                  "  thread: {joint: N.2, friction: {mu: 0.12, radius: 11 mm, flank: 15 deg}}\n"
                  "run: {output_step: 0.1}\n");
    for (int k = 0; k < WAYS; k++) {
        kempe_trajectory *run = simulate(&l, &ways[k], 2);
        if (run) {
            const kmp_log_entry *end = entry(run, "friction", 1);
            CHECK(end && strstr(end->text, "sticks") && end->t > 0.5 && end->t < 1.5);
            CHECK(fabs(last_q(run)[1]) > 1e-3 && last_qd(run)[1] == 0 && last_qd(run)[0] == 0);
            CHECK_NEAR(last_lambda(run)[1], 600 * 9.81, 1e-9);
        }
        kempe_trajectory_free(run);
    }
    unload(&l);
}

/* -- check ------------------------------------------------------------------------------------------------------------
 */

static void says(const char *more, double mu, const char *words)
{
    loaded l = screw(0.005, -4000, 0, mu, more, 0);
    kempe_check *check = NULL;
    char *text = NULL;
    CHECK(kempe_check_new(l.system, &check) == KEMPE_OK && kempe_check_print(check, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && check_says(text, words));
    if (text && !check_says(text, words))
        printf("%s\n", text);
    kempe_text_free(text);
    kempe_check_free(check);
    unload(&l);
}

static void self_locking_is_stated(void)
{
    says(", flank: 15 deg", 0.12, " self-locking 'rub' on 'J.2': lead angle 4.138 deg, angle of friction 7.082 deg");
    says(", flank: 15 deg", 0.06, "not self-locking 'rub' on 'J.2': lead angle 4.138 deg, angle of friction 3.554 deg");
    says(", mu_static: 0.12", 0.06, " self-locking 'rub' on 'J.2': lead angle 4.138 deg, angle of friction 6.843 deg");
}

/* -- what is refused
 * --------------------------------------------------------------------------------------------------- */

#define BODY(joint) "kempe: 1\nbodies: {s: {joint: {name: J, " joint ", at: ground}, mass: 4, inertia: {zz: 0.05}}}\n"
#define THREAD      BODY("screw: z, pitch: 5 mm")

static void refused(void)
{
    load_rejected(THREAD "forces: {f: {joint: J.1, friction: {mu: 0.1, radius: 11 mm}}}\n",
                  "'J.1' is the displacement of a screw; the friction of its thread acts on the rotation: joint: J.2");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: 0.1}}}\n", "has no key 'radius'");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: [0.1, 0.2], radius: 11 mm}}}\n",
                  "a thread has one coefficient; its levels differ by the direction of the load");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: 0.1, radius: 0}}}\n", "it must be positive");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: -0.1, radius: 11 mm}}}\n", "it must not be negative");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: 0.1, radius: 11 mm, flank: 90 deg}}}\n",
                  "less than a right angle");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: 15, radius: 11 mm}}}\n",
                  "no torque turns this thread against its load: its lead angle, 4.138 deg, and the angle of friction, "
                  "86.19 deg, are 90 deg or more together");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {torque: 0.1, flank: 15 deg}}}\n",
                  "flank is for friction with mu");
    load_rejected(THREAD "forces: {f: {joint: J.2, friction: {mu: 0.1, radius: 11 mm, speed: 1}}}\n",
                  "friction with a speed has one level for both directions");
    load_rejected(BODY("revolute: z") "forces: {f: {joint: J, friction: {mu: 0.1, radius: 11 mm, flank: 15 deg}}}\n",
                  "a flank is for the thread of a screw");
}

int main(void)
{
    TEST(thresholds);
    TEST(begins_later_by_the_static_coefficient);
    TEST(motion_with_friction);
    TEST(instances_and_derivatives);
    TEST(jack_holds_its_load);
    TEST(self_locking_is_stated);
    TEST(refused);
    return check_report();
}
