/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow 14 */
/* Generated equations in programs with integrators of their own, which need nothing of Kempe: friction that sticks,
 * with a choice of modes (belt_loop.c), whose transitions are closed forms; states with samples and events
 * (sampled_loop.c); continuous delays (delay_loop.c) and rigid contacts (contact_loop.c), in all languages, and the
 * friction of these (slip_loop_numpy.py). */
#include "generate/compiled_equations.h"
#include "sanitized.h"
#include <math.h>

/* Runge-Kutta steps of order 4 of 1e-3 s for 50 s are right to some 1e-11. */
#define ALLOWED 1e-9

/* A program that wrote all it had to write and ended well: one whose reader leaves early fails. */
static void close_program(FILE *pipe)
{
    char rest[512];
    while (pipe && fgets(rest, sizeof rest, pipe))
        ;
    CHECK(pipe && pclose(pipe) == 0);
}

static bool write_equations(const char *name, const char *sets)
{
    const kempe_generate_options g = {.sets = sets, .drives = 1, .language = "c"};
    kempe_model *model = NULL;
    char path[1024];
    snprintf(path, sizeof path, "%s/tests/models/%s.yaml", KEMPE_ROOT, name);
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    bool ok = model && emit(model, &g);
    kempe_model_free(model);
    return ok;
}

static FILE *start_loop(const char *program, const char *name)
{
    char command[1024];
    snprintf(command, sizeof command,
             "cd %s && %s -std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -I. -o loop %s/tests/generate/%s %s.c -lm",
             folder, KEMPE_CC, KEMPE_ROOT, program, name);
    if (!runs(command))
        return NULL;
    snprintf(command, sizeof command, "%s/loop", folder);
    return popen(command, "r");
}

/* Mass 1 and spring 1 on a belt of 0.2 m/s: friction 0.6 in slip, 1 in stick. The block slips until it has the rate of
 * the belt, sticks until the spring is 1, and slips in the half circle of x'' = 0.6 - x around 0.6 back to 0.2. */
static void transitions(void)
{
    const double pi = acos(-1), slips = 2 * (pi - atan(2));
    double t = asin(1 / 3.0), x = 0.6 * (1 - sqrt(8) / 3);
    int count = 0, mode;
    double at, place;
    FILE *pipe =
        write_equations("friction_belt", "M_C+h_J+jdqd,friction") ? start_loop("belt_loop.c", "friction_belt") : NULL;
    CHECK(pipe != NULL);
    while (pipe && fscanf(pipe, "%lf %lf %d", &at, &place, &mode) == 3) {
        CHECK_NEAR(at, t, ALLOWED);
        CHECK_NEAR(place, x, ALLOWED);
        CHECK(mode == (count % 2 ? -1 : 0));
        t += count % 2 ? slips : (1 - x) / 0.2;
        x = count % 2 ? 0.2 : 1;
        count++;
    }
    close_program(pipe);
    CHECK(count == 13);
}

/* x'' = u - a x' with u = -30 (x - 1) - 4 x' at each sample of 0.05; the times at which x passes 0.9 from below. */
static void samples_and_events(void)
{
    const double a = 0.2, every = 0.05, end = 2.03;
    double x = 0.1, v = 0, u = 0, passes = 0, got_x = NAN, got_v = NAN, got_u = NAN, got_passes = NAN, t;
    for (int k = 0; k * every < end; k++) {
        u = -30 * (x - 1) - 4 * v;
        for (int part = 0; part < 50 && k * every + part * every / 50 < end - 1e-9; part++) {
            double h = every / 50, decay = exp(-a * h), drift = (1 - decay) / a, before = x;
            x += v * drift + u / a * (h - drift);
            v = v * decay + u * drift;
            passes += x > 0.9 && before <= 0.9;
        }
    }
    FILE *pipe =
        write_equations("sampled_slide", "M_C,discrete") ? start_loop("sampled_loop.c", "sampled_slide") : NULL;
    CHECK(pipe && fscanf(pipe, "%lf %lf %lf %lf %lf", &t, &got_x, &got_v, &got_u, &got_passes) == 5);
    close_program(pipe);
    CHECK_NEAR(got_x, x, ALLOWED);
    CHECK_NEAR(got_v, v, ALLOWED);
    CHECK_NEAR(got_u, u, ALLOWED);
    CHECK(passes >= 1 && got_passes == passes);
}

/* -- all languages ------------------------------------------------------------------------------------- */

/* Equations of a model under the name machine; `name`: its path without ending. */
static bool write_machine(const char *name, const char *language, const char *sets)
{
    const kempe_generate_options g = {.sets = sets, .drives = 1, .language = language};
    kempe_model *model = NULL;
    char path[1024], text[8192] = "", line[1024];
    snprintf(path, sizeof path, "%s/%s.yaml", KEMPE_ROOT, name);
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file))
        if (strncmp(line, "name:", 5) != 0 && strlen(text) + strlen(line) < sizeof text)
            strcat(text, line);
    CHECK(file && fclose(file) == 0);
    CHECK(kempe_model_read_text(context, text, "machine", &model) == KEMPE_OK);
    bool ok = model && emit(model, &g);
    kempe_model_free(model);
    return ok;
}

enum { C, PYTHON, OCTAVE, LANGUAGES };

static const char *const languages[LANGUAGES] = {"c", "python", "octave"};

/* Texts in other languages are written under sanitizers as well; programs of these languages have none, and are run
 * without. */
#ifdef SANITIZED
#define RUN_LANGUAGES 1
#else
#define RUN_LANGUAGES LANGUAGES
#endif

/* The command that runs a loop in a language, which it builds; empty: no tools for it are here. */
static void find_loop(int language, const char *loop, char command[512])
{
    command[0] = 0;
    if (language == C)
        snprintf(command, 512,
                 "%s -std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -I. -o loop %s/tests/generate/%s.c "
                 "machine.c -lm && ./loop",
                 KEMPE_CC, KEMPE_ROOT, loop);
    else if (language == PYTHON && python())
        snprintf(command, 512, "%s %s/tests/generate/%s_numpy.py . machine", python(), KEMPE_ROOT, loop);
    else if (language == OCTAVE && has_octave())
        snprintf(command, 512, "octave-cli --norc --no-history --quiet %s/tests/generate/%s_octave.m .", KEMPE_ROOT,
                 loop);
}

/* A loop in a language, with equations of a model; NULL: it is not run here. */
static FILE *start_machine(int language, const char *program, const char *sets, const char *model,
                           const char *arguments)
{
    char loop[512] = "", command[1024];
    if (language < RUN_LANGUAGES)
        find_loop(language, program, loop);
    CHECK(write_machine(model, languages[language], sets));
    if (!loop[0]) {
        printf("skipped: %s is not run here\n", languages[language]);
        return NULL;
    }
    snprintf(command, sizeof command, "cd %s && %s %s", folder, loop, arguments);
    FILE *pipe = popen(command, "r");
    CHECK(pipe != NULL);
    return pipe;
}

static FILE *start_contacts(int language, const char *model, const char *arguments)
{
    return start_machine(language, "contact_loop", "M_C+h_J+jdqd,contact,impact", model, arguments);
}

/* The next line is of this event. */
static void expect_event(FILE *pipe, const char *kind, double t)
{
    char word[16] = "";
    double at = NAN;
    CHECK(fscanf(pipe, "%15s %lf", word, &at) == 2);
    CHECK_TEXT(word, kind);
    CHECK_NEAR(at, t, ALLOWED);
}

static void expect_number(FILE *pipe, double x)
{
    double number = NAN;
    CHECK(fscanf(pipe, "%lf", &number) == 1);
    CHECK_NEAR(number, x, ALLOWED);
}

static void ends_well(FILE *pipe)
{
    char word[16];
    CHECK(fscanf(pipe, "%15s", word) == EOF);
    close_program(pipe);
}

/* -- delays -------------------------------------------------------------------------------------------- */

/* x'' = -4 x(t - 1/2) with x = 1 before the start: the sum of (-4)^n (t - (n - 1)/2)^(2 n)/(2 n)! over the n of which
 * the difference is positive. y'' = cos(3 (t - 1/4)), y from rest. */
static void delayed_slides(int language)
{
    const double t = 2, phase = 3 * t - 0.75;
    double x = 1, rate = 0, factor = 1;
    for (int n = 1; t > (n - 1) * 0.5; n++) {
        double since = t - (n - 1) * 0.5;
        factor *= -4.0 / ((2 * n - 1) * 2 * n);
        x += factor * pow(since, 2 * n);
        rate += 2 * n * factor * pow(since, 2 * n - 1);
    }
    FILE *pipe = start_machine(language, "delay_loop", "M_C+h_J+jdqd,delay", "tests/models/delayed_slides",
                               "400 2 1 0 0 0 0 0 0 0.1 0 0");
    if (!pipe)
        return;
    expect_number(pipe, x);
    expect_number(pipe, rate);
    expect_number(pipe, (cos(0.75) - cos(phase)) / 9 + t * sin(0.75) / 3);
    expect_number(pipe, (sin(phase) + sin(0.75)) / 3);
    expect_number(pipe, 0.1 * t);
    expect_number(pipe, 0.1);
    close_program(pipe);
}

/* A slider-crank under a delayed controller: digits of bench/machines/delayed_crank.csv at 0.8 s. */
static void delayed_crank(void)
{
    const double pi = acos(-1), tilt = asin(sin(pi / 3) / 3);
    char arguments[256];
    snprintf(arguments, sizeof arguments, "16000 0.8 %.17g %.17g %.17g 0 0 0 0 0 0 0", pi / 3, -pi / 3 - tilt,
             0.05 + 0.3 * cos(tilt));
    FILE *pipe = start_machine(C, "delay_loop", "M_C+h_J+jdqd,delay", "bench/machines/delayed_crank", arguments);
    expect_number(pipe, 2.69239008634525485);
    expect_number(pipe, -14.2913257147816187);
    CHECK(pipe && fscanf(pipe, "%*f %*f") == 0);
    expect_number(pipe, 0.206761149583171165);
    expect_number(pipe, 0.432270355542859838);
    close_program(pipe);
}

static void delays(void)
{
    for (int language = 0; language < LANGUAGES; language++)
        delayed_slides(language);
    delayed_crank();
}

/* -- contacts ------------------------------------------------------------------------------------------ */

/* A ball from a height of 1 with restitution 0.8: all its impacts, then it rests. */
static void bouncing(int language)
{
    const double g = 9.81, times[] = {0.5, 1, 2, 3};
    double rate = sqrt(2 * g), t = sqrt(2 / g);
    FILE *pipe = start_contacts(language, "tests/models/contact_bounce", "0.02 1 0 0.5 1 2 3 5");
    int impacts = 0;
    for (size_t next = 0; pipe && impacts < 100; impacts++) {
        expect_event(pipe, "impact", t);
        rate *= 0.8;
        if (2 * rate / g < 1e-6)
            break;
        for (; next < sizeof times / sizeof *times && times[next] < t + 2 * rate / g; next++) {
            double since = times[next] - t;
            expect_event(pipe, "state", times[next]);
            expect_number(pipe, rate * since - g * since * since / 2);
            expect_number(pipe, rate - g * since);
        }
        t += 2 * rate / g;
    }
    if (!pipe)
        return;
    CHECK(impacts == 61);
    expect_event(pipe, "close", t);
    expect_event(pipe, "state", 5);
    expect_number(pipe, 0);
    expect_number(pipe, 0);
    ends_well(pipe);
}

/* A slider-crank with a stop: digits of bench/machines/contact_slider_crank.csv. */
static void stopped(int language)
{
    FILE *pipe =
        start_contacts(language, "tests/models/contact_slider_crank", "1.5e-4 0 0 0 20 -28 0 0.8610219179246947933");
    double rod = NAN;
    if (!pipe)
        return;
    expect_event(pipe, "impact", 0.2203733629703244412);
    expect_event(pipe, "impact", 0.8391515889912118162);
    expect_event(pipe, "state", 0.8610219179246947933);
    expect_number(pipe, -1.788620030722777372);
    CHECK(fscanf(pipe, "%lf", &rod) == 1);
    expect_number(pipe, -0.2829297764952493555);
    CHECK(fscanf(pipe, "%*f %*f %*f") == 0);
    ends_well(pipe);
}

/* The friction of contacts, in two directions (slip_loop_numpy.py): digits of bench/machines/contact_incline.csv,
 * places, rates and forces across the incline; and an impact whose friction slips, or sticks: the impulse of the bound
 * is 0.2 times the normal one. */
static void rubbing(void)
{
    static const double slipping[3][6] = {{0.1186585706099023806, 0.3530472720523030274, 0.8070703476875576015,
                                           0.8784751614301736158, -6.636904444002612258, -7.22409851823591732},
                                          {0.3491276355013764726, 0.4859873058057478585, 0.9802528702972455081,
                                           0.2810489615903570058, -9.430063961463684226, -2.703699998650709521},
                                          {0.8471100124487581919, 0.5386819697150027696, 0.9998507890096419595,
                                           0.02443039012034318525, -9.807072917122110316, -0.2396263721922559364}};
    const double fall = sqrt(2 * 9.81), left = 5 - 0.2 * 1.6 * fall, times[] = {0.25, 0.5, 1};
    static const char *const sets = "M_C+h_J+jdqd,friction,impact";
    char command[1024];
    if (!python()) {
        printf("skipped: no python3 with NumPy here\n");
        return;
    }
    CHECK(write_machine("tests/models/contact_incline", "python", sets));
    snprintf(command, sizeof command, "%s %s/tests/generate/slip_loop_numpy.py %s motion 0.0025 0 0 0 0 2 0 0.25 0.5 1",
             python(), KEMPE_ROOT, folder);
    FILE *pipe = popen(command, "r");
    for (int k = 0; pipe && k < 3; k++) {
        expect_number(pipe, times[k]);
        for (int i = 0; i < 8; i++) /* nothing moves off the incline */
            expect_number(pipe, i % 3 == 2 && i < 6 ? 0 : slipping[k][i < 2 ? i : i < 6 ? i - 1 : i - 2]);
    }
    close_program(pipe);
    CHECK(write_machine("tests/models/contact_oblique", "python", sets));
    for (int sticks = 0; sticks < 2; sticks++) {
        const double part = sticks ? 0.1 : 1;
        snprintf(command, sizeof command, "%s %s/tests/generate/slip_loop_numpy.py %s impact 0 0 0.1 %.17g %.17g %.17g",
                 python(), KEMPE_ROOT, folder, 3 * part, 4 * part, -fall);
        pipe = popen(command, "r");
        const double after[3] = {sticks ? 0 : 0.6 * left, sticks ? 0 : 0.8 * left, 0.6 * fall};
        for (int i = 0; pipe && i < 3; i++)
            expect_number(pipe, after[i]);
        close_program(pipe);
    }
}

static void contacts(void)
{
    for (int language = 0; language < LANGUAGES; language++) {
        bouncing(language);
        stopped(language);
    }
}

int main(void)
{
    context = kempe_context_new();
    if (!mkdtemp(folder))
        return 1;
    TEST(transitions);
    TEST(samples_and_events);
    TEST(delays);
    TEST(contacts);
    TEST(rubbing);
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
