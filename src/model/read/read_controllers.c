/* SPDX-License-Identifier: BSD-3-Clause */
/* Controllers with proportional, integral and derivative parts.
 *
 * Controller (Astrom and Hagglund 1995, chapter 3): v = Kp e + i + Kd d, u = v between its limits, i' = Ki e + (u -
 * v)/Tt, where d is the derivative of e through a lag of Tf, (e - f)/Tf with f' = d. A sampled one has the integral by
 * forward and the derivative by backward differences. */
#include "model/read/read_controllers.h"
#include "model/data/model.h"
#include "model/read/function_block.h"
#include "model/read/read_states.h"
#include "model/read/read_values.h"
#include <math.h>

/* -- controllers ------------------------------------------------------------------------------------- */

static bool has(const kmp_function_block *b, const char *key)
{
    return kmp_yaml_get(b->map, key);
}

/* Its states: the held output of a sampled one, the integral, the filtered input. */
static int integral_of(const kmp_function_block *b)
{
    return b->sampled;
}

static int filtered_of(const kmp_function_block *b)
{
    return b->sampled + has(b, "integral");
}

static int count_pid(kmp_reader *r, kmp_function_block *b)
{
    int own = has(b, "integral") + has(b, "filter");
    b->direct = !b->sampled;
    if (own == 0 && !b->sampled)
        kmp_reader_complain(
            r, b->map->place,
            "%s: a controller has an integral, or a derivative with a filter; write it as an expression", b->what);
    return b->sampled + own > 0 ? b->sampled + own : 1;
}

static const char *suffix_of_pid(const kmp_function_block *b, int state)
{
    return has(b, "integral") && state == integral_of(b) ? "integral" : "filtered";
}

static bool check_pid(kmp_reader *r, const kmp_function_block *b)
{
    if (has(b, "derivative") && has(b, "filter") == has(b, "slope"))
        return kmp_reader_complain(
            r, b->map->place, "%s: a derivative has the time 'filter', or the rate of the input as 'slope'", b->what);
    if (b->sampled && has(b, "start") && !has(b, "integral"))
        return kmp_reader_complain(
            r, kmp_yaml_get(b->map, "start")->place,
            "%s: 'start' is where the integral begins, and this controller has none: leave it out", b->what);
    if (!has(b, "derivative") && (has(b, "filter") || has(b, "slope")))
        return kmp_reader_complain(r, b->map->place, "%s: 'filter' and 'slope' belong to a derivative", b->what);
    if (has(b, "limits") && has(b, "integral") && !has(b, "tracking") && !has(b, "proportional"))
        return kmp_reader_complain(r, b->map->place, "%s: limits of an integral alone need the time 'tracking'",
                                   b->what);
    return true;
}

/* A positive time, as a local. */
static void read_time(kmp_reader *r, const kmp_function_block *b, const char *key, kmp_expr_locals *locals)
{
    double value = 1;
    const kmp_yaml *node = kmp_yaml_get(b->map, key);
    kmp_block_local(locals, key, kmp_block_key(r, b, key, &value));
    if (node)
        (void)kmp_check_rule(r, node, kmp_reader_say(r, "%s of %s", key, b->what), KMP_FIELD_POSITIVE, value, "");
}

/* The sum of its parts. */
static const kmp_expr *sum_of(kmp_reader *r, const kmp_function_block *b, const kmp_expr_locals *locals)
{
    const char *derivative = has(b, "slope")     ? " + kd*slope"
                             : !has(b, "filter") ? ""
                             : b->sampled        ? " + kd*(e - f)/(filter + T)"
                                                 : " + kd*(e - f)/filter";
    return kmp_block_formula(r,
                             kmp_reader_say(r, "%s%s%s", has(b, "proportional") ? "kp*e" : "0",
                                            has(b, "integral") ? " + i" : "", derivative),
                             locals);
}

/* The rate of the integral. Without a time the difference of both sums is taken back within the geometric mean of the
 * integral's and the derivative's times, or the integral's time. */
static const kmp_expr *integral_law(kmp_reader *r, const kmp_function_block *b, const kmp_expr_locals *locals)
{
    const char *back = !has(b, "limits")      ? ""
                       : has(b, "tracking")   ? " + (u - v)/tracking"
                       : has(b, "derivative") ? " + (u - v)/sqrt(kd/ki)"
                                              : " + (u - v)/(kp/ki)";
    return kmp_block_formula(r, kmp_reader_say(r, b->sampled ? "i + T*(ki*e%s)" : "ki*e%s", back), locals);
}

static void read_pid(kmp_reader *r, kmp_function_block *b)
{
    kmp_number limit[2];
    kmp_expr_locals locals = {0}, ends = {0};
    bool good = check_pid(r, b), limited = kmp_block_two(r, b, "limits", limit);
    kmp_block_local(&locals, "e", kmp_block_input(r, b));
    kmp_block_local(&locals, "kp", kmp_block_key(r, b, "proportional", NULL));
    kmp_block_local(&locals, "ki", kmp_block_key(r, b, "integral", NULL));
    kmp_block_local(&locals, "kd", kmp_block_key(r, b, "derivative", NULL));
    read_time(r, b, "filter", &locals);
    read_time(r, b, "tracking", &locals);
    if (has(b, "slope"))
        kmp_block_local(&locals, "slope",
                        kmp_read_expr(r, kmp_yaml_get(b->map, "slope"), kmp_reader_say(r, "slope of %s", b->what),
                                      KMP_DIM_ANY, KMP_OF_STATE));
    if (b->sampled)
        kmp_block_local(&locals, "T", kmp_block_period(r, b));
    if (has(b, "integral"))
        kmp_block_local(&locals, "i", kmp_block_state(r, b, integral_of(b)));
    if (has(b, "filter"))
        kmp_block_local(&locals, "f", kmp_block_state(r, b, filtered_of(b)));
    if (!good || r->wrong)
        return;
    const kmp_expr *v = sum_of(r, b, &locals), *u = v;
    if (limited) {
        kmp_block_local(&ends, "v", v);
        kmp_block_local(&ends, "low", kmp_block_number(r, &limit[0]));
        kmp_block_local(&ends, "high", kmp_block_number(r, &limit[1]));
        u = kmp_block_formula(r, "min(high, max(low, v))", &ends);
        kmp_block_local(&locals, "v", v);
        kmp_block_local(&locals, "u", u);
    }
    if (b->direct)
        kmp_block_value(r, b, u);
    else
        kmp_block_law(r, b, 0, u);
    if (has(b, "integral")) {
        kmp_block_law(r, b, integral_of(b), integral_law(r, b, &locals));
        r->model->states[b->first + integral_of(b)].start = r->model->states[b->first].start;
    }
    if (has(b, "filter"))
        kmp_block_law(r, b, filtered_of(b),
                      kmp_block_formula(r, b->sampled ? "(filter*f + T*e)/(filter + T)" : "(e - f)/filter", &locals));
}

const kmp_block_kind kmp_block_pid = {"pid", " proportional integral derivative filter slope limits tracking sample ",
                                      count_pid, suffix_of_pid, read_pid};
