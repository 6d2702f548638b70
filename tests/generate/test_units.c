/* SPDX-License-Identifier: BSD-3-Clause */
/* The layers of functional mock-up units on a pendulum written by hand: modes, misuse, states, derivatives. */
#include "exchange/simulator/kempe_fmu.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "testing.h"
#include "unit/simulated_mechanisms.h"

#include <stdlib.h>

const kempe_fmu_model kempe_fmu_exported = {
    &pendulum, "token", KEMPE_FMU_MODEL_EXCHANGE | KEMPE_FMU_CO_SIMULATION, 1e-10, 1e-10, 0.02, NULL, NULL};

#define AT(block, k) ((unsigned)(block)*KEMPE_FMU_BLOCK + (unsigned)(k))

/* -- messages ---------------------------------------------------------------------------------------- */

static int messages;
static char last[640];

static void note(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)category;
    messages += status > fmi3Warning;
    snprintf(last, sizeof last, "%s", message);
}

static void note2(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
                  fmi2String format, ...)
{
    (void)instance;
    note(environment, (fmi3Status)status, category, format);
}

static const fmi2CallbackFunctions functions = {note2, calloc, free, NULL, NULL};

/* The call is an error with a sentence that has the word. */
#define REFUSED(call, word)                                                                                            \
    do {                                                                                                               \
        int before = messages;                                                                                         \
        int status = (int)(call);                                                                                      \
        CHECK(status == fmi3Error || status == fmi3Discard);                                                           \
        CHECK(messages == before + 1 && strstr(last, word));                                                           \
        if (!strstr(last, word))                                                                                       \
            printf("  %s\n", last);                                                                                    \
    } while (0)
#define FINE(call) CHECK((int)(call) == fmi3OK)

static fmi3Instance exchange(void)
{
    return fmi3InstantiateModelExchange("one", "token", NULL, false, false, NULL, note);
}

static fmi3Instance simulation(void)
{
    return fmi3InstantiateCoSimulation("one", "token", NULL, false, false, false, false, NULL, 0, NULL, note, NULL);
}

static void begin(fmi3Instance c)
{
    FINE(fmi3EnterInitializationMode(c, true, 1e-10, 0, true, 100));
    FINE(fmi3ExitInitializationMode(c));
}

static void step(fmi3Instance c, double t, double h)
{
    fmi3Boolean event, terminate, early;
    fmi3Float64 reached;
    FINE(fmi3DoStep(c, t, h, true, &event, &terminate, &early, &reached));
    CHECK(!event && !terminate && !early && fabs(reached - t - h) < 1e-12);
}

/* -- settings ---------------------------------------------------------------------------------------- */

/* The longest step of the model, one of the importer, and any, as numbers of steps over one second. */
static void steps_are_bounded(void)
{
    const unsigned longest = AT(KEMPE_FMU_SETTINGS, 3), steps = AT(KEMPE_FMU_WORK, 2);
    const double given[] = {0.02, 0.005, 0};
    fmi3Int32 taken[3] = {0};
    for (int k = 0; k < 3; k++) {
        fmi3Instance c = simulation();
        fmi3Float64 usual = -1;
        FINE(fmi3GetFloat64(c, &longest, 1, &usual, 1));
        CHECK(usual == 0.02);
        if (k > 0)
            FINE(fmi3SetFloat64(c, &longest, 1, given + k, 1));
        begin(c);
        step(c, 0, 1);
        FINE(fmi3GetInt32(c, &steps, 1, taken + k, 1));
        fmi3FreeInstance(c);
    }
    CHECK(taken[0] >= 50 && taken[0] < 75);
    CHECK(taken[1] >= 200 && taken[1] < 225);
    CHECK(taken[2] < 50);
}

/* -- misuse ------------------------------------------------------------------------------------------ */

static void tokens_are_compared(void)
{
    CHECK(!fmi3InstantiateModelExchange("one", "other", NULL, false, false, NULL, note) && strstr(last, "token"));
    CHECK(!fmi3InstantiateModelExchange("one", NULL, NULL, false, false, NULL, NULL));
    CHECK(!fmi3InstantiateModelExchange("", "token", NULL, false, false, NULL, note) && strstr(last, "name"));
    CHECK(!fmi3InstantiateScheduledExecution("one", "token", NULL, false, false, NULL, note, NULL, NULL, NULL));
    CHECK(strstr(last, "scheduled"));
    CHECK(!fmi2Instantiate("one", fmi2CoSimulation, "other", NULL, &functions, 0, 0) && strstr(last, "guid"));
    CHECK(!fmi2Instantiate("one", fmi2CoSimulation, "token", NULL, NULL, 0, 0));
    CHECK(strcmp(fmi3GetVersion(), "3.0") == 0 && strcmp(fmi2GetVersion(), "2.0") == 0);
    fmi3FreeInstance(NULL);
    fmi2FreeInstance(NULL);
}

static void no_instance_is_an_error(void)
{
    fmi3Boolean yes;
    fmi3Float64 x = 0;
    CHECK(fmi3Terminate(NULL) == fmi3Error && fmi3Reset(NULL) == fmi3Error);
    CHECK(fmi3GetFloat64(NULL, NULL, 0, &x, 0) == fmi3Error && fmi3GetString(NULL, NULL, 0, NULL, 0) == fmi3Error);
    CHECK(fmi3CompletedIntegratorStep(NULL, true, &yes, &yes) == fmi3Error);
    CHECK(fmi2DoStep(NULL, 0, 1, 1) == fmi2Error && fmi2NewDiscreteStates(NULL, NULL) == fmi2Error);
}

static void calls_out_of_order_are_errors(void)
{
    fmi3Instance c = exchange();
    fmi3Float64 x[2] = {0};
    fmi3Boolean yes;
    size_t count = 0;
    REFUSED(fmi3ExitInitializationMode(c), "Instantiated");
    REFUSED(fmi3SetTime(c, 1), "fmi3SetTime");
    REFUSED(fmi3Terminate(c), "not allowed");
    begin(c);
    REFUSED(fmi3SetContinuousStates(c, x, 3), "2 continuous states");
    REFUSED(fmi3GetContinuousStates(c, NULL, 2), "2 continuous states");
    REFUSED(fmi3CompletedIntegratorStep(c, true, &yes, &yes), "Event Mode");
    REFUSED(fmi3DoStep(c, 0, 1, true, &yes, &yes, &yes, x), "fmi3DoStep");
    REFUSED(fmi3UpdateDiscreteStates(c, NULL, NULL, NULL, NULL, NULL, NULL), "NULL");
    FINE(fmi3EnterContinuousTimeMode(c));
    REFUSED(fmi3SetTime(c, NAN), "not a finite");
    x[0] = NAN;
    REFUSED(fmi3SetContinuousStates(c, x, 2), "smaller step");
    REFUSED(fmi3EnterConfigurationMode(c), "structural");
    REFUSED(fmi3GetIntervalDecimal(c, NULL, 0, NULL, NULL), "clocks");
    REFUSED(fmi3ActivateModelPartition(c, 0, 0), "scheduled");
    REFUSED(fmi3GetNumberOfVariableDependencies(c, 0, &count), "modelDescription.xml");
    FINE(fmi3Terminate(c));
    FINE(fmi3Reset(c));
    begin(c);
    fmi3FreeInstance(c);
}

static void values_are_checked(void)
{
    const unsigned input = AT(KEMPE_FMU_INPUTS, 0), fixed = AT(KEMPE_FMU_PARAMETERS, 0),
                   tunable = AT(KEMPE_FMU_PARAMETERS, 1), output = AT(KEMPE_FMU_QDD, 0), none = AT(KEMPE_FMU_BLOCKS, 0),
                   behind = AT(KEMPE_FMU_Q, 99);
    fmi3Instance c = simulation();
    fmi3Float64 x = NAN, one = 1;
    fmi3Int32 whole = 0;
    REFUSED(fmi3GetFloat64(c, &output, 1, &x, 1), "no value yet");
    begin(c);
    REFUSED(fmi3SetFloat64(c, &input, 1, &x, 1), "not a finite");
    REFUSED(fmi3SetFloat64(c, &fixed, 1, &one, 1), "is fixed");
    REFUSED(fmi3SetFloat64(c, &output, 1, &one, 1), "is computed");
    REFUSED(fmi3SetFloat64(c, &none, 1, &one, 1), "value reference");
    REFUSED(fmi3GetFloat64(c, &behind, 1, &x, 1), "value reference");
    REFUSED(fmi3GetFloat64(c, &input, 1, &x, 2), "as many values");
    REFUSED(fmi3GetFloat64(c, NULL, 1, &x, 1), "value reference");
    REFUSED(fmi3GetInt32(c, &input, 1, &whole, 1), "Int32");
    REFUSED(fmi3SetInt32(c, &input, 1, &whole, 1), "Int32");
    REFUSED(fmi3GetBoolean(c, &input, 1, NULL, 1), "Boolean");
    FINE(fmi3GetString(c, NULL, 0, NULL, 0));
    FINE(fmi3SetFloat64(c, &tunable, 1, &one, 1));
    FINE(fmi3GetFloat64(c, &tunable, 1, &x, 1));
    CHECK(x == 1);
    fmi3FreeInstance(c);
}

static void steps_are_checked(void)
{
    fmi2Component c = fmi2Instantiate("one", fmi2CoSimulation, "token", NULL, &functions, 0, 0);
    fmi2Real reached = 0;
    fmi2Boolean ended = 1;
    FINE(fmi2SetupExperiment(c, 0, 0, 0, 1, 1));
    REFUSED(fmi2SetupExperiment(c, 1, -1, 0, 0, 0), "tolerance");
    REFUSED(fmi2SetupExperiment(c, 0, 0, 2, 1, 1), "interval");
    FINE(fmi2EnterInitializationMode(c));
    FINE(fmi2ExitInitializationMode(c));
    REFUSED(fmi2DoStep(c, 0.5, 0.1, 1), "the unit is at");
    REFUSED(fmi2DoStep(c, 0, 0, 1), "not positive");
    REFUSED(fmi2DoStep(c, 0, NAN, 1), "not positive");
    REFUSED(fmi2DoStep(c, NAN, 1, 1), "the unit is at");
    REFUSED(fmi2DoStep(c, 0, 2, 1), "stop time");
    FINE(fmi2DoStep(c, 0, 0.5, 1));
    FINE(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &reached));
    FINE(fmi2GetBooleanStatus(c, fmi2Terminated, &ended));
    CHECK(reached == 0.5 && !ended);
    REFUSED(fmi2CancelStep(c), "at once");
    REFUSED(fmi2GetStatus(c, fmi2DoStepStatus, NULL), "no such status");
    fmi2FreeInstance(c);
}

/* A pendulum of another length begins where its loop can be closed; one of length NaN is refused. */
static void starts_are_checked(void)
{
    const unsigned length = AT(KEMPE_FMU_PARAMETERS, 0), q = AT(KEMPE_FMU_Q, 0), x = AT(KEMPE_FMU_STATES, 0);
    fmi3Instance c = simulation();
    fmi3Float64 value = 1.1, place[2];
    const unsigned both[] = {q, q + 1};
    FINE(fmi3SetFloat64(c, &length, 1, &value, 1));
    FINE(fmi3EnterInitializationMode(c, false, 0, 0, false, 0));
    FINE(fmi3GetFloat64(c, both, 2, place, 2));
    CHECK_NEAR(hypot(place[0], place[1]), 1.1, 1e-12);
    value = 0.3;
    FINE(fmi3SetFloat64(c, &length, 1, &value, 1));
    FINE(fmi3GetFloat64(c, both, 2, place, 2));
    CHECK_NEAR(hypot(place[0], place[1]), 0.3, 1e-12);
    REFUSED(fmi3SetFloat64(c, &x, 1, &value, 1), "is computed");
    FINE(fmi3ExitInitializationMode(c));
    REFUSED(fmi3SetFloat64(c, &q, 1, &value, 1), "before the end of initialisation");
    fmi3FreeInstance(c);
}

/* -- states and derivatives -------------------------------------------------------------------------- */

static void states_are_restored(void)
{
    const unsigned seen[] = {AT(KEMPE_FMU_Q, 0), AT(KEMPE_FMU_Q, 1), AT(KEMPE_FMU_QDD, 0), AT(KEMPE_FMU_LAMBDA, 0)};
    fmi3Instance c = simulation(), d = simulation();
    fmi3FMUState state = NULL, copy = NULL;
    fmi3Float64 first[4], again[4], other[4];
    size_t size = 0;
    begin(c);
    step(c, 0, 0.7);
    FINE(fmi3GetFMUState(c, &state));
    step(c, 0.7, 0.9);
    FINE(fmi3GetFloat64(c, seen, 4, first, 4));
    FINE(fmi3SetFMUState(c, state));
    step(c, 0.7, 0.9);
    FINE(fmi3GetFloat64(c, seen, 4, again, 4));
    CHECK(memcmp(first, again, sizeof first) == 0);
    FINE(fmi3SerializedFMUStateSize(c, state, &size));
    fmi3Byte *bytes = malloc(size);
    REFUSED(fmi3SerializeFMUState(c, state, bytes, size - 1), "too small");
    FINE(fmi3SerializeFMUState(c, state, bytes, size));
    REFUSED(fmi3DeserializeFMUState(d, bytes, size - 1, &copy), "not a state");
    FINE(fmi3DeserializeFMUState(d, bytes, size, &copy));
    FINE(fmi3SetFMUState(d, copy));
    step(d, 0.7, 0.9);
    FINE(fmi3GetFloat64(d, seen, 4, other, 4));
    CHECK(memcmp(first, other, sizeof first) == 0);
    bytes[0] ^= 1;
    REFUSED(fmi3DeserializeFMUState(d, bytes, size, &copy), "not a state");
    REFUSED(fmi3SetFMUState(d, NULL), "NULL");
    free(bytes);
    FINE(fmi3FreeFMUState(c, &state));
    FINE(fmi3FreeFMUState(d, &copy));
    CHECK(!state && !copy);
    fmi3FreeInstance(c);
    fmi3FreeInstance(d);
}

static void derivatives_are_checked(void)
{
    const unsigned x[] = {AT(KEMPE_FMU_STATES, 0), AT(KEMPE_FMU_STATES, 1), AT(KEMPE_FMU_INPUTS, 0)},
                   y[] = {AT(KEMPE_FMU_RATES, 0), AT(KEMPE_FMU_RATES, 1)}, q = AT(KEMPE_FMU_Q, 0);
    const fmi3Float64 way[] = {0.3, -0.2, 0.7}, seed[] = {0.4, 0.9};
    fmi3Float64 change[2], back[3];
    fmi3Instance c = exchange();
    REFUSED(fmi3GetDirectionalDerivative(c, y, 2, x, 3, way, 3, change, 2), "not allowed");
    begin(c);
    FINE(fmi3GetDirectionalDerivative(c, y, 2, x, 3, way, 3, change, 2));
    FINE(fmi3GetAdjointDerivative(c, y, 2, x, 3, seed, 2, back, 3));
    CHECK_NEAR(seed[0] * change[0] + seed[1] * change[1], back[0] * way[0] + back[1] * way[1] + back[2] * way[2],
               1e-13);
    CHECK_NEAR(change[0], way[1], 1e-15);
    REFUSED(fmi3GetDirectionalDerivative(c, y, 2, &q, 1, way, 1, change, 2), "not one of time");
    REFUSED(fmi3GetDirectionalDerivative(c, &x[2], 1, x, 3, way, 3, change, 1), "has no derivatives");
    REFUSED(fmi3GetDirectionalDerivative(c, y, 2, x, 3, way, 2, change, 2), "as many values");
    REFUSED(fmi3GetAdjointDerivative(c, NULL, 2, x, 3, seed, 2, back, 3), "NULL");
    fmi3FreeInstance(c);
}

/* -- any order --------------------------------------------------------------------------------------- */

static unsigned long long chance = 88172645463325252ull;

static int any(int below)
{
    chance ^= chance << 13;
    chance ^= chance >> 7;
    chance ^= chance << 17;
    return (int)(chance % (unsigned)below);
}

static double any_number(void)
{
    static const double numbers[] = {0, 1, -1, 0.1, 1e300, -1e-300, 0.7, 3};
    int k = any(10);
    return k < 8 ? numbers[k] : k == 8 ? NAN : INFINITY;
}

static unsigned any_reference(void)
{
    return AT(any(KEMPE_FMU_BLOCKS + 1), any(5));
}

/* One call of any function with any arguments. */
static fmi3Status any_call(fmi3Instance c, fmi3FMUState *state)
{
    const unsigned time = 0;
    unsigned r[2] = {any_reference(), any_reference()}, s[2] = {any_reference(), any_reference()};
    fmi3Float64 x[2] = {any_number(), any_number()}, t = 0, out[2], now;
    fmi3Int32 whole[2], orders[2] = {1, any(3)};
    fmi3Boolean b[4];
    (void)fmi3GetFloat64(c, &time, 1, &now, 1);
    switch (any(22)) {
    case 0:
    case 1:
        return fmi3EnterInitializationMode(c, any(2), 1e-6, 0, any(2), x[0]);
    case 2:
    case 3:
        return fmi3ExitInitializationMode(c);
    case 4:
        return fmi3EnterEventMode(c);
    case 5:
        return fmi3UpdateDiscreteStates(c, b, b + 1, b + 2, b + 3, b, &t);
    case 6:
        return fmi3EnterContinuousTimeMode(c);
    case 7:
        return fmi3EnterStepMode(c);
    case 8:
        return fmi3SetFloat64(c, r, 2, x, 2);
    case 9:
        return fmi3SetFloat64(c, r, 1, x, 1);
    case 10:
        return fmi3GetFloat64(c, r, 1, x, 1);
    case 11:
        return fmi3GetInt32(c, r, 1, whole, 1);
    case 12:
        return fmi3SetContinuousStates(c, x, 2);
    case 13:
        return fmi3GetContinuousStateDerivatives(c, x, 2);
    case 14:
        return fmi3CompletedIntegratorStep(c, true, b, b + 1);
    case 15:
        return fmi3DoStep(c, now, fabs(x[0]) < 10 ? x[0] : 0.01, true, b, b + 1, b + 2, &t);
    case 16:
        return fmi3GetFMUState(c, state);
    case 17:
        return *state ? fmi3SetFMUState(c, *state) : fmi3OK;
    case 18:
        return fmi3GetDirectionalDerivative(c, r, 2, s, 2, x, 2, out, 2);
    case 19:
        return fmi3GetAdjointDerivative(c, r, 2, s, 2, x, 2, out, 2);
    case 20:
        return fmi3GetOutputDerivatives(c, r, 2, orders, out, 2);
    default:
        return any(7) == 0 ? fmi3Reset(c) : fmi3SetTime(c, x[0]);
    }
}

/* Calls in any order: a status each time, and no access outside of memory. */
static void any_order_of_calls_has_a_status(void)
{
    for (int k = 0; k < 300; k++) {
        fmi3Instance c = k % 2 ? exchange()
                               : fmi3InstantiateCoSimulation("one", "token", NULL, false, k % 3, k % 4 < 2, k % 8 < 4,
                                                             NULL, 0, NULL, note, NULL);
        fmi3FMUState state = NULL;
        for (int i = 0; i < 60; i++)
            CHECK(any_call(c, &state) <= fmi3Error);
        FINE(fmi3FreeFMUState(c, &state));
        fmi3FreeInstance(c);
    }
    CHECK(messages > 1000);
}

int main(void)
{
    TEST(steps_are_bounded);
    TEST(tokens_are_compared);
    TEST(no_instance_is_an_error);
    TEST(calls_out_of_order_are_errors);
    TEST(values_are_checked);
    TEST(steps_are_checked);
    TEST(starts_are_checked);
    TEST(states_are_restored);
    TEST(derivatives_are_checked);
    TEST(any_order_of_calls_has_a_status);
    return check_report();
}
