/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * Ride comfort: accelerations of a run, weighted as people feel them (EN 12299, ISO 2631-1), and Sperling's ride index.
 *
 *     kempe_comfort_options options = {.vertical = "acceleration(car.floor).z"};
 *     kempe_comfort *comfort;
 *     kempe_comfort_new(system, &options, &comfort);
 */
#ifndef KEMPE_COMFORT_H
#define KEMPE_COMFORT_H

#include <kempe/table.h>

KEMPE_BEGIN

/** NULL and 0 take the default. Lists of outputs of one value in m/s^2, as in kempe/output_handles.h. Without any list
 * they are the accelerations of points that the model requests: x along, y across, z vertical. */
typedef struct kempe_comfort_options {
    size_t size;              /* sizeof this struct; 0: its size in version 0.1 */
    const char *vertical;     /* weighted by Wb; Wz of vertical accelerations */
    const char *lateral;      /* Wd; Wz of lateral ones */
    const char *longitudinal; /* Wd */
    const char *seat_back;    /* Wc: longitudinal, at the back of a seat */
    double from;              /* s: the windows begin here; the filters at the start of the run */
    double rate;              /* samples per second, at least 400; default: 1000 */
    const kempe_run_options *run;
    const char *seat; /* Wk of ISO 2631-1: vertical, on a seat, as of road vehicles */
} kempe_comfort_options;

typedef struct kempe_comfort kempe_comfort;

/** Runs the model and evaluates its accelerations, in windows of 5 s. KEMPE_E_ARGUMENT: a name or number is wrong,
 * there is no acceleration, or the run is shorter than a window. KEMPE_E_FAILED, KEMPE_STOPPED: the run did not reach
 * its end. */
KEMPE_API kempe_status kempe_comfort_new(const kempe_system *system, const kempe_comfort_options *options,
                                         kempe_comfort **comfort);
KEMPE_API void kempe_comfort_free(kempe_comfort *comfort);

KEMPE_API kempe_status kempe_comfort_print(const kempe_comfort *comfort, kempe_format format, char **text);

/** Tables, to be freed with kempe_table_free. KEMPE_E_ARGUMENT: another name.
 * "signals": direction, name, weighting. Root mean squares rms and weighted; median, percentile_95 and largest of the
 * weighted ones of the windows. Wz, unknown where there is none. The largest relative difference of these values with
 * every other sample. "windows": t at the end of each window, and each signal's weighted root mean square. */
KEMPE_API kempe_status kempe_comfort_table(const kempe_comfort *comfort, const char *name, kempe_table **table);

/** The k-th signals of the lists longitudinal, lateral and vertical are a place: the number of such places. The mean
 * comfort N_MV = 6 sqrt(aX^2 + aY^2 + aZ^2) of one, from the 95th percentiles in m/s^2 (EN 12299). */
KEMPE_API int kempe_comfort_place_count(const kempe_comfort *comfort);
KEMPE_API double kempe_comfort_mean_comfort(const kempe_comfort *comfort, int place);

KEMPE_END
#endif
