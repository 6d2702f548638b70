/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * The part of a functional mock-up unit that both versions of the FMI share: variables, modes of an instance, messages,
 * states, derivatives. kempe_fmi2.c and kempe_fmi3.c translate the functions of the FMI into these. C99, no allocation,
 * no data that several instances share.
 *
 * The value reference of a variable is its block times KEMPE_FMU_BLOCK plus its place in the block.
 */
#ifndef KEMPE_FMU_H
#define KEMPE_FMU_H

#include "kempe_simulator.h"
#include <stddef.h>

enum { KEMPE_FMU_BLOCK = 1000000 };

/** Blocks of variables; the last two have integers. */
enum {
    KEMPE_FMU_TIME,
    KEMPE_FMU_STATES, /* f independent coordinates, f rates */
    KEMPE_FMU_RATES,  /* their derivatives */
    KEMPE_FMU_Q,      /* coordinates: before the start, near which the loops are closed */
    KEMPE_FMU_QD,
    KEMPE_FMU_QDD,
    KEMPE_FMU_LAMBDA,
    KEMPE_FMU_OUTPUTS,
    KEMPE_FMU_INPUTS, /* three each: value, first and second derivative */
    KEMPE_FMU_PARAMETERS,
    KEMPE_FMU_CONDITIONS, /* event indicators */
    KEMPE_FMU_SETTINGS,   /* of the integrator of co-simulation: rtol, atol, fixed_step, longest */
    KEMPE_FMU_CHOICE,     /* f numbers of coordinates, from 1 */
    KEMPE_FMU_WORK,       /* exchanges of independent coordinates, events, steps, evaluations */
    KEMPE_FMU_BLOCKS
};
enum { KEMPE_FMU_SETTINGS_COUNT = 4, KEMPE_FMU_WORK_COUNT = 4 };

enum { KEMPE_FMU_MODEL_EXCHANGE = 1, KEMPE_FMU_CO_SIMULATION = 2 };

/** The mechanism of the unit, a constant of the generated sources. */
typedef struct kempe_fmu_model {
    const kempe_equations *equations;
    const char *token; /* guid, instantiationToken */
    unsigned kinds;    /* KEMPE_FMU_MODEL_EXCHANGE, KEMPE_FMU_CO_SIMULATION */
    double rtol, atol; /* of co-simulation where the importer gives no tolerance */
    double longest;    /* step of co-simulation where the importer gives none, s; 0: any */
    /* The mechanism is in the resources of the instance: returns the table of it, only for this instance, or NULL
     * with a sentence. NULL: this table belongs to the mechanism. */
    const struct kempe_fmu_model *(*open)(const char *resources, char *sentence, size_t size);
    void (*close)(const struct kempe_fmu_model *opened);
} kempe_fmu_model;

/* Names that begin with the prefix of the unit's functions, where the importer compiles them with one. */
#if defined(FMI3_ACTUAL_FUNCTION_PREFIX)
#define KEMPE_FMU_PREFIX FMI3_ACTUAL_FUNCTION_PREFIX
#elif defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define KEMPE_FMU_PREFIX FMI3_FUNCTION_PREFIX
#elif defined(FMI2_FUNCTION_PREFIX)
#define KEMPE_FMU_PREFIX FMI2_FUNCTION_PREFIX
#else
#define KEMPE_FMU_PREFIX
#endif
#define KEMPE_FMU_JOIN_(prefix, name) prefix##name
#define KEMPE_FMU_JOIN(prefix, name)  KEMPE_FMU_JOIN_(prefix, name)
#define KEMPE_FMU_NAME(name)          KEMPE_FMU_JOIN(KEMPE_FMU_PREFIX, name)

#define kempe_fmu_exported KEMPE_FMU_NAME(kempe_fmu_exported)
extern const kempe_fmu_model kempe_fmu_exported;

/** As in both versions of the FMI. */
typedef enum kempe_fmu_status {
    KEMPE_FMU_OK,
    KEMPE_FMU_WARNING,
    KEMPE_FMU_DISCARD,
    KEMPE_FMU_ERROR,
    KEMPE_FMU_FATAL
} kempe_fmu_status;

/** Modes of an instance, as bits: a function is allowed in some of them. */
enum {
    KEMPE_FMU_INSTANTIATED = 1,
    KEMPE_FMU_INITIALIZATION = 2,
    KEMPE_FMU_EVENT = 4,
    KEMPE_FMU_CONTINUOUS = 8,
    KEMPE_FMU_STEP = 16,
    KEMPE_FMU_INTERMEDIATE = 32,
    KEMPE_FMU_TERMINATED = 64,
    KEMPE_FMU_RUNS = KEMPE_FMU_EVENT | KEMPE_FMU_CONTINUOUS | KEMPE_FMU_STEP | KEMPE_FMU_INTERMEDIATE,
    KEMPE_FMU_ANY = KEMPE_FMU_RUNS | KEMPE_FMU_INSTANTIATED | KEMPE_FMU_INITIALIZATION | KEMPE_FMU_TERMINATED
};

/** Categories of messages. */
enum {
    KEMPE_FMU_LOG_EVENTS,
    KEMPE_FMU_LOG_WARNING,
    KEMPE_FMU_LOG_DISCARD,
    KEMPE_FMU_LOG_ERROR,
    KEMPE_FMU_LOG_STEPS,
    KEMPE_FMU_LOG_CATEGORIES
};
extern const char *const kempe_fmu_categories[KEMPE_FMU_LOG_CATEGORIES + 1]; /* the last one: logAll */

typedef struct kempe_fmu kempe_fmu;
typedef void kempe_fmu_logger(kempe_fmu *fmu, kempe_fmu_status status, const char *category, const char *sentence);
/** After a step of the integrator inside of a communication step. Returns 1 where the importer wants to go back to its
 * own work at `*until`, a later time of the same communication step. */
typedef int kempe_fmu_observer(kempe_fmu *fmu, double t, double *until);

/** An instance. */
struct kempe_fmu {
    const kempe_fmu_model *model;
    kempe_simulator simulator;
    kempe_fmu_logger *log;
    unsigned logged;            /* categories, as bits */
    int kind;                   /* KEMPE_FMU_MODEL_EXCHANGE or KEMPE_FMU_CO_SIMULATION */
    struct kempe_fmu_standing { /* in addition to the simulator, part of a saved state */
        double t, stop;         /* stop: INFINITY where there is none */
        int mode;
        int started; /* the start is computed */
        int placed;  /* the importer gave start values of coordinates, other than the unit's own ones */
        int moved;   /* model exchange: t, x or u are newer than the simulator */
        int pressed; /* inputs are newer than the simulator */
        int tuned;   /* parameters are newer than the simulator */
        int ended;   /* a condition ended the motion */
        int event;   /* co-simulation has stopped at an event, which is not decided yet */
    } now;
    struct kempe_fmu_numbers {
        double *x, *start, *given;           /* 2 f; 2 n; values that the importer gave, the others NaN */
        double *held, *value, *kept;         /* conditions that held, their values; a saved state */
        double *along_x, *along_p, *along_u; /* a direction */
        double *dx, *states, *q, *qd, *qdd, *lambda, *y, *dvalue; /* changes along it; 2 f */
        int *choice;
    } part;
};

enum { KEMPE_FMU_SENTENCE = 640 };

/** The mechanism of an instance with this name, token and kind; NULL: there is none, for the reason in `sentence`. */
const kempe_fmu_model *kempe_fmu_open(const char *name, const char *token, int kind, const char *resources,
                                      char sentence[KEMPE_FMU_SENTENCE]);
/** After the last call for an instance. */
void kempe_fmu_close(const kempe_fmu_model *model);

/** The number of doubles in the memory of an instance. */
int kempe_fmu_memory(const kempe_fmu_model *model);
/** Sets all but `log` and `logged`. */
void kempe_fmu_init(kempe_fmu *fmu, const kempe_fmu_model *model, int kind, double *memory);
void kempe_fmu_reset(kempe_fmu *fmu);

/** Sends a sentence to the importer: messages with a status always, the others if their category is on. Returns the
 * status. */
kempe_fmu_status kempe_fmu_say(kempe_fmu *fmu, kempe_fmu_status status, int category, const char *format, ...);
/** 1 in one of these modes, otherwise an error that names the function. */
int kempe_fmu_allows(kempe_fmu *fmu, int modes, const char *function);
/** Switches categories. ERROR: a name that is none. */
kempe_fmu_status kempe_fmu_choose_categories(kempe_fmu *fmu, int on, size_t count, const char *const *names);

kempe_fmu_status kempe_fmu_set_up(kempe_fmu *fmu, int tolerance_given, double tolerance, double start, int stop_given,
                                  double stop);
kempe_fmu_status kempe_fmu_enter_initialization(kempe_fmu *fmu);
kempe_fmu_status kempe_fmu_exit_initialization(kempe_fmu *fmu, int mode);
/** The simulator with all that was set: called before values are read. */
kempe_fmu_status kempe_fmu_refresh(kempe_fmu *fmu);

kempe_fmu_status kempe_fmu_get(kempe_fmu *fmu, const unsigned *references, size_t count, double *values);
kempe_fmu_status kempe_fmu_set(kempe_fmu *fmu, const unsigned *references, size_t count, const double *values);
kempe_fmu_status kempe_fmu_get_integers(kempe_fmu *fmu, const unsigned *references, size_t count, int *values);
/** An error where there are references, for types of which the unit has no variables or none that can be set. */
kempe_fmu_status kempe_fmu_no_variables(kempe_fmu *fmu, size_t count, const unsigned *references, const char *type);

/** ERROR: the unit saves no states. */
kempe_fmu_status kempe_fmu_saves_states(kempe_fmu *fmu);
/** Bytes of a saved state, and it. */
size_t kempe_fmu_state_bytes(kempe_fmu *fmu);
void kempe_fmu_save(kempe_fmu *fmu, unsigned char *to);
kempe_fmu_status kempe_fmu_restore(kempe_fmu *fmu, const unsigned char *from);
/** ERROR: bytes that are not a state of this unit. */
kempe_fmu_status kempe_fmu_check_state(kempe_fmu *fmu, const unsigned char *bytes, size_t size);

kempe_fmu_status kempe_fmu_directional(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                       const unsigned *knowns, size_t known_count, const double *seed,
                                       double *sensitivity);
kempe_fmu_status kempe_fmu_adjoint(kempe_fmu *fmu, const unsigned *unknowns, size_t unknown_count,
                                   const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity);
/** Time derivatives of outputs at constant inputs. */
kempe_fmu_status kempe_fmu_output_rates(kempe_fmu *fmu, const unsigned *references, size_t count, const int *orders,
                                        double *values);

/* -- model exchange -- */
kempe_fmu_status kempe_fmu_set_time(kempe_fmu *fmu, double t);
kempe_fmu_status kempe_fmu_set_states(kempe_fmu *fmu, const double *x, size_t count);
kempe_fmu_status kempe_fmu_get_states(kempe_fmu *fmu, double *x, size_t count);
kempe_fmu_status kempe_fmu_get_rates(kempe_fmu *fmu, double *dx, size_t count);
/** Conditions that are events; the others only bend the motion. */
int kempe_fmu_indicators(const kempe_fmu *fmu);
kempe_fmu_status kempe_fmu_get_indicators(kempe_fmu *fmu, double *value, size_t count);
kempe_fmu_status kempe_fmu_get_nominals(kempe_fmu *fmu, double *nominal, size_t count);
/** Decides events. *changed: states have new values or meanings; *exchanged: they belong to other coordinates; *next:
 * the time of the next sample, INFINITY where there is none. */
kempe_fmu_status kempe_fmu_update(kempe_fmu *fmu, int *changed, int *exchanged, int *ended, double *next);
kempe_fmu_status kempe_fmu_completed_step(kempe_fmu *fmu, int *wants_event, int *ended);

/* -- co-simulation -- */
typedef struct kempe_fmu_stride {
    int stops_at_events;          /* return after the first event */
    kempe_fmu_observer *observer; /* NULL: none */
    double reached;               /* time, result */
    int event, early, ended;      /* results */
} kempe_fmu_stride;
kempe_fmu_status kempe_fmu_do_step(kempe_fmu *fmu, double from, double step, kempe_fmu_stride *stride);

#endif
