/* SPDX-License-Identifier: BSD-3-Clause */
/* Frequency responses of the quarter car on wishbones against its closed form: with z of the body and the angle a of
 * the wishbones, level at rest,
 *
 *     M = [mb + mw + 2 ma, (mw + ma) L; ., (mw + 2/3 ma) L^2],   K = kt [1, L; L, L^2] + k [0, 0; 0, f^2],
 *
 * G likewise of the dampers, and the formulation w at the right side (kt + i omega ct) (1, L)' w. Neither the spring
 * nor the tyre changes it by its load: their ends move on circles to which they are tangent. */
#include "testing.h"
#include <complex.h>
#include <kempe/kempe.h>
#include <kempe/linearize.h>
#include <kempe/response.h>
#include <kempe/settings.h>
#include <stdlib.h>
#include <string.h>

typedef double complex number;
#define NUMBER number
#define ALL    4
#include "elimination.h"

static const double mb = 250, mw = 40, ma = 4, L = 0.4, f = 0.25, k = 60e3, kt = 200e3;
static double c = 3500, ct = 100;
static const double pi = 3.14159265358979323846;

typedef struct loaded {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
} loaded;

static loaded load(int count, const kempe_setting *settings)
{
    loaded l = {.context = kempe_context_new()};
    CHECK(kempe_model_read_set(l.context, KEMPE_ROOT "/examples/ride/ride.yaml", settings, count, &l.model) ==
          KEMPE_OK);
    CHECK(l.model && kempe_system_new(l.model, &l.system) == KEMPE_OK);
    return l;
}

static void unload(loaded *l)
{
    kempe_system_free(l->system);
    kempe_model_free(l->model);
    kempe_context_free(l->context);
}

/* z and a over w. */
static void solve(double hz, number *z, number *a)
{
    number s = 2 * pi * hz * I, tyre = kt + ct * s, spring = k + c * s;
    number m11 = s * s * (mb + mw + 2 * ma) + tyre, m12 = s * s * (mw + ma) * L + tyre * L;
    number m22 = s * s * (mw + ma * 2 / 3) * L * L + tyre * L * L + spring * f * f;
    number det = m11 * m22 - m12 * m12;
    *z = (tyre * m22 - m12 * tyre * L) / det;
    *a = tyre * s * s * L * (mb + ma) / det; /* (m11 L - m12) tyre without cancelling */
}

enum { BODY, TRAVEL, ACCELERATION, TYRE, REACTION, OUTPUTS };

static const char *const outputs = "q(body),travel,acceleration(body.L).z,force(tyre),reaction(T).z";

static void closed_form(double hz, number *y)
{
    number z, a, s = 2 * pi * hz * I;
    solve(hz, &z, &a);
    y[BODY] = z;
    y[TRAVEL] = L * a;
    y[ACCELERATION] = s * s * z;
    y[TYRE] = s * s * ((mb + mw + 2 * ma) * z + (mw + ma) * L * a); /* what it carries beside the weight */
    y[REACTION] = ma * s * s * (z / 2 + L / 3 * a);                 /* what carries the end of the upper wishbone */
}

static kempe_response *respond(const loaded *l, const kempe_response_options *options)
{
    kempe_response *r = NULL;
    kempe_status status = kempe_response_new(l->system, options, &r);
    if (status != KEMPE_OK)
        printf("%s\n", kempe_context_message(l->context));
    CHECK(status == KEMPE_OK);
    return r;
}

/* The force of the tyre is positive when it pulls, the reaction has its own sign: either is compared. The reaction is a
 * difference of forces like that of the tyre, and exact beside that. */
static double distance(number got, const number *expected, int output)
{
    double off = cabs(got - expected[output]), other = cabs(got + expected[output]);
    return (output >= TYRE ? fmin(off, other) : off) / cabs(expected[output == REACTION ? TYRE : output]);
}

static kempe_table *table_of(const kempe_response *r, const char *name)
{
    kempe_table *table = NULL;
    CHECK(kempe_response_table(r, name, &table) == KEMPE_OK);
    return table;
}

/* Output o of the only input, in a row of the table. */
static number answer(const kempe_table *rows, int row, int o)
{
    double phase = kempe_table_number(rows, row, 2 + 2 * o) * pi / 180;
    return kempe_table_number(rows, row, 1 + 2 * o) * cexp(I * phase);
}

static void the_quarter_car_has_its_closed_form(void)
{
    loaded l = load(0, NULL);
    const kempe_response_options options = {.inputs = "drive(road)", .outputs = outputs, .frequencies = "0.2:50:60"};
    kempe_response *r = respond(&l, &options);
    kempe_table *rows = table_of(r, "rows");
    CHECK(kempe_table_row_count(rows) == 60 && kempe_table_column_count(rows) == 1 + 2 * OUTPUTS);
    double worst[OUTPUTS] = {0};
    CHECK(kempe_table_number(rows, 0, 0) == 0.2 && kempe_table_number(rows, 59, 0) == 50);
    for (int j = 0; j < 60; j++) {
        number y[OUTPUTS];
        closed_form(kempe_table_number(rows, j, 0), y);
        for (int o = 0; o < OUTPUTS; o++)
            worst[o] = fmax(worst[o], distance(answer(rows, j, o), y, o));
    }
    for (int o = 0; o < OUTPUTS; o++)
        CHECK(worst[o] < 1e-12);
    kempe_table_free(rows);
    kempe_response_free(r);
    unload(&l);
}

/* The closed form has the values of each peak there, and less on both sides. */
static void check_peaks(const kempe_table *peaks, int count, double aside)
{
    CHECK(kempe_table_row_count(peaks) == count);
    for (int j = 0; j < kempe_table_row_count(peaks); j++) {
        number y[OUTPUTS], below[OUTPUTS], above[OUTPUTS];
        int o = strcmp(kempe_table_word(peaks, j, 1), "q.body") == 0 ? BODY : TRAVEL;
        double hz = kempe_table_number(peaks, j, 2), amplitude = kempe_table_number(peaks, j, 3);
        double gain = kempe_table_number(peaks, j, 5);
        closed_form(hz, y);
        closed_form(hz * (1 - aside), below);
        closed_form(hz * (1 + aside), above);
        CHECK_NEAR(amplitude / cabs(y[o]), 1, 1e-11);
        CHECK_NEAR(kempe_table_number(peaks, j, 4) * pi / 180, carg(y[o]), 1e-11);
        CHECK(cabs(below[o]) < amplitude && cabs(above[o]) < amplitude);
        if (o == TRAVEL)
            CHECK(isnan(gain));
        else
            CHECK_NEAR(gain, amplitude, 1e-11); /* at rest the formulation lifts it all */
    }
}

static const kempe_response_options too_few_to_see_them = {
    .inputs = "drive(road)", .outputs = "q(body),travel", .frequencies = "0.2:50:12"};

static void peaks_are_where_they_are(void)
{
    loaded l = load(0, NULL);
    kempe_response *r = respond(&l, &too_few_to_see_them);
    kempe_table *peaks = table_of(r, "peaks");
    check_peaks(peaks, 3, 1e-4); /* the body has one alone */
    kempe_table_free(peaks);
    kempe_response_free(r);
    unload(&l);
}

/* Far narrower than the steps. */
static void narrow_peaks_are_found(void)
{
    const kempe_setting little[] = {{"c", "5"}, {"tyre_c", "0"}};
    loaded l = load(2, little);
    c = 5;
    ct = 0;
    kempe_response *r = respond(&l, &too_few_to_see_them);
    kempe_table *peaks = table_of(r, "peaks");
    check_peaks(peaks, 4, 1e-6);
    for (int j = 0; j < 4; j++)
        CHECK(kempe_table_number(peaks, j, 3) > 5);
    kempe_table_free(peaks);
    kempe_response_free(r);
    unload(&l);
    c = 3500;
    ct = 100;
}

static void poles_without_damping_are_reported(void)
{
    const kempe_setting none[] = {{"c", "0"}, {"tyre_c", "0"}};
    loaded l = load(2, none);
    double m11 = mb + mw + 2 * ma, m12 = (mw + ma) * L, m22 = (mw + ma * 2 / 3) * L * L;
    double k12 = kt * L, k22 = kt * L * L + k * f * f;
    double a = m11 * m22 - m12 * m12, b = m11 * k22 + m22 * kt - 2 * m12 * k12, d = kt * k22 - k12 * k12;
    double root = sqrt(b * b - 4 * a * d),
           hz[2] = {sqrt(2 * d / (b + root)) / (2 * pi), sqrt((b + root) / (2 * a)) / (2 * pi)};
    char range[64];
    (void)snprintf(range, sizeof range, "%.17g:50:30", hz[0]);
    const kempe_response_options options = {.inputs = "drive(road)", .outputs = "q(body)", .frequencies = range};
    kempe_response *r = respond(&l, &options);
    kempe_table *rows = table_of(r, "rows"), *peaks = table_of(r, "peaks");
    int count = kempe_table_row_count(peaks);
    CHECK(isnan(creal(answer(rows, 0, 0))) && isfinite(creal(answer(rows, 1, 0))));
    CHECK(count == 2 || count == 1);
    for (int j = 0; j < count; j++) {
        CHECK_NEAR(kempe_table_number(peaks, j, 2) / (count == 1 ? hz[1] : hz[j]), 1, 1e-12);
        CHECK(isinf(kempe_table_number(peaks, j, 3)) && isnan(kempe_table_number(peaks, j, 4)));
    }
    kempe_table_free(rows);
    kempe_table_free(peaks);
    char *text = NULL;
    CHECK(kempe_response_print(r, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "undamped modes at ") && strstr(text, "unbounded"));
    kempe_text_free(text);
    kempe_response_free(r);
    unload(&l);
}

/* C (s - A)^-1 B + D with the drive's displacement, rate and acceleration as three inputs. */
static void the_state_space_answers_likewise(void)
{
    loaded l = load(0, NULL);
    kempe_linearization *lin = NULL;
    int rows, n;
    CHECK(kempe_linearization_new(l.system, &(kempe_linearize_options){.inputs = "drive(road)", .outputs = outputs},
                                  &lin) == KEMPE_OK);
    const double *A = kempe_linearization_matrix(lin, KEMPE_MATRIX_A, &n, &n);
    const double *B = kempe_linearization_matrix(lin, KEMPE_MATRIX_B, &rows, &n);
    const double *C = kempe_linearization_matrix(lin, KEMPE_MATRIX_C, &rows, &n);
    const double *D = kempe_linearization_matrix(lin, KEMPE_MATRIX_D, &rows, &n);
    CHECK(rows == OUTPUTS && n == 3);
    CHECK_TEXT(kempe_linearization_name(lin, KEMPE_CHANNEL_INPUT, 2), "drive(road).dd");
    CHECK_TEXT(kempe_linearization_unit(lin, KEMPE_CHANNEL_INPUT, 1), "m/s");
    CHECK_TEXT(kempe_linearization_name(lin, KEMPE_CHANNEL_OUTPUT, ACCELERATION), "acceleration.body.L.z");
    for (int j = 0; j < 8; j++) {
        double hz = 0.3 * pow(2.1, j);
        number s = 2 * pi * hz * I, w[] = {1, s, s * s}, a[4][4], x[4] = {0}, y[OUTPUTS];
        for (int i = 0; i < 4; i++)
            for (int e = 0; e < 4; e++)
                a[i][e] = (i == e ? s : 0) - A[i + 4 * e];
        for (int i = 0; i < 4; i++)
            for (int e = 0; e < 3; e++)
                x[i] += B[i + 4 * e] * w[e];
        eliminate(a, x);
        closed_form(hz, y);
        for (int o = 0; o < OUTPUTS; o++) {
            number got = 0;
            for (int e = 0; e < 4; e++)
                got += C[o + OUTPUTS * e] * x[e];
            for (int e = 0; e < 3; e++)
                got += D[o + OUTPUTS * e] * w[e];
            CHECK(distance(got, y, o) < 1e-10);
        }
    }
    kempe_linearization_free(lin);
    unload(&l);
}

/* A mass on a spring k and a damper c to a place u that an input moves, by the rate of an expression, and pressed onto
 * a surface with a law: (k + c s)/(s^2 + c s + k). A sensor is the rate of u. */
static void dampers_read_the_rate_of_an_input(void)
{
    static const char *const laws[] = {
        "forces: {f: {joint: x, force: \"-100 N/m*(q(x) - u) - 4 N*s/m*rate(q(x) - u)\"}}\n",
        "contacts: {f: {gap: q(x) - u, force: \"max(0, 100*depth + 4*rate)\"}}\n"
        "forces: {w: {joint: x, force: -50}}\n"};
    for (int way = 0; way < 2; way++) {
        char text[512];
        (void)snprintf(text, sizeof text,
                       "kempe: 1\ninputs: {u: {unit: m}}\n"
                       "bodies: {b: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n%s"
                       "sensors: {speed: rate(u)}\n",
                       laws[way]);
        loaded l = {.context = kempe_context_new()};
        CHECK(kempe_model_read_text(l.context, text, "model.yaml", &l.model) == KEMPE_OK);
        CHECK(l.model && kempe_system_new(l.model, &l.system) == KEMPE_OK);
        kempe_response *r =
            respond(&l, &(kempe_response_options){.inputs = "u", .outputs = "q(x),speed", .frequencies = "0.5:10:8"});
        kempe_table *rows = table_of(r, "rows");
        CHECK(kempe_table_row_count(rows) == 8);
        for (int j = 0; j < 8; j++) {
            const number s = 2 * pi * kempe_table_number(rows, j, 0) * I;
            CHECK(cabs(answer(rows, j, 0) - (100 + 4 * s) / (s * s + 4 * s + 100)) < 1e-12);
            CHECK(cabs(answer(rows, j, 1) - s) < 1e-11);
        }
        kempe_table_free(rows);
        kempe_response_free(r);
        unload(&l);
    }
}

/* The status, and whether the sentence has these words. */
static void refuses(const loaded *l, kempe_response_options options, kempe_status expected, const char *words)
{
    kempe_response *r = NULL;
    CHECK(kempe_response_new(l->system, &options, &r) == expected && !r);
    CHECK(strstr(kempe_context_message(l->context), words) != NULL);
    if (!strstr(kempe_context_message(l->context), words))
        printf("%s\n", kempe_context_message(l->context));
}

static void what_cannot_be_asked_is_said(void)
{
    loaded l = load(0, NULL);
    refuses(&l, (kempe_response_options){.inputs = ""}, KEMPE_E_ARGUMENT, "a frequency response needs inputs");
    refuses(&l, (kempe_response_options){.inputs = "drive(raod)"}, KEMPE_E_ARGUMENT, "did you mean 'road'?");
    refuses(&l, (kempe_response_options){.inputs = "effort(bdoy)"}, KEMPE_E_ARGUMENT, "did you mean 'body'?");
    refuses(&l, (kempe_response_options){.inputs = "force(body.Q.x)"}, KEMPE_E_ARGUMENT, "no point 'Q'");
    refuses(&l, (kempe_response_options){.inputs = "moment(body)"}, KEMPE_E_ARGUMENT, "unknown input 'moment(body)'");
    refuses(&l, (kempe_response_options){.inputs = "k,k"}, KEMPE_E_ARGUMENT, "'k' is given twice");
    refuses(&l, (kempe_response_options){.inputs = "stiffness"}, KEMPE_E_ARGUMENT, "no parameter 'stiffness'");
    refuses(&l, (kempe_response_options){.inputs = "length"}, KEMPE_E_ARGUMENT, "'length' moves closures");
    refuses(&l, (kempe_response_options){.inputs = "k", .outputs = "tavel"}, KEMPE_E_ARGUMENT,
            "unknown output 'tavel'");
    refuses(&l, (kempe_response_options){.inputs = "k", .outputs = "q(body).x"}, KEMPE_E_ARGUMENT, "no components");
    refuses(&l, (kempe_response_options){.inputs = "k", .at = "end"}, KEMPE_E_ARGUMENT, "'end'");
    refuses(&l, (kempe_response_options){.inputs = "k", .independent = "plate,body"}, KEMPE_E_FAILED, "plate");
    refuses(&l, (kempe_response_options){.inputs = "k", .frequencies = "0:10"}, KEMPE_E_ARGUMENT, "--linear");
    refuses(&l, (kempe_response_options){.inputs = "k", .frequencies = "10:1"}, KEMPE_E_ARGUMENT, "'10:1'");
    refuses(&l, (kempe_response_options){.inputs = "k", .frequencies = "5"}, KEMPE_E_ARGUMENT, "A:B");
    unload(&l);
    const kempe_setting heavier[] = {{"support", "0 N"}};
    l = load(1, heavier);
    refuses(&l, (kempe_response_options){.inputs = "k", .at = "start"}, KEMPE_E_FAILED, "not an equilibrium");
    unload(&l);
}

static void count_warnings(void *user, kempe_level level, const char *line)
{
    *(int *)user += level == KEMPE_LOG_WARNING && strstr(line, "do not trust the response at 1 Hz");
}

/* A mass that swings once a second without a damper: beside its pole the terms of the equation cancel. */
static void rounding_beside_a_pole_is_reported(void)
{
    static const char text[] =
        "kempe: 1\nname: swing\nbodies:\n"
        "  m: {joint: {name: A, prismatic: x, at: ground}, mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}\n"
        "forces: {s: {joint: A, force: \"-(2*3.14159265358979323846)^2*q(A)\"}}\n";
    static const char *const frequencies[] = {"0.5:1.5:4", "0.99999999999:1.5:4"};
    loaded l = {.context = kempe_context_new()};
    int warnings = 0;
    CHECK(kempe_model_read_text(l.context, text, "model.yaml", &l.model) == KEMPE_OK);
    CHECK(kempe_system_new(l.model, &l.system) == KEMPE_OK);
    kempe_context_set_log(l.context, count_warnings, &warnings);
    for (int i = 0; i < 2; i++) {
        const kempe_response_options options = {
            .inputs = "effort(A)", .outputs = "q(A)", .frequencies = frequencies[i], .linear = 1};
        kempe_response *r = NULL;
        char *json = NULL;
        CHECK(kempe_response_new(l.system, &options, &r) == (i ? KEMPE_UNTRUSTED : KEMPE_OK));
        CHECK(warnings == i);
        CHECK(kempe_response_print(r, KEMPE_JSON, &json) == KEMPE_OK);
        CHECK(json && strstr(json, i ? "\"result\": \"not converged\"" : "\"result\": \"converged\""));
        kempe_text_free(json);
        kempe_response_free(r);
    }
    unload(&l);
}

int main(void)
{
    TEST(the_quarter_car_has_its_closed_form);
    TEST(peaks_are_where_they_are);
    TEST(narrow_peaks_are_found);
    TEST(poles_without_damping_are_reported);
    TEST(the_state_space_answers_likewise);
    TEST(dampers_read_the_rate_of_an_input);
    TEST(rounding_beside_a_pole_is_reported);
    TEST(what_cannot_be_asked_is_said);
    return check_report();
}
