/* SPDX-License-Identifier: BSD-3-Clause */
/* Physical dimensions: exponents of m, kg and s; and the units of numbers (units.def). */
#pragma once

#include "model/language/nearest.h"
#include <stdbool.h>
#include <stddef.h>

/* The radians of a turn; and an angle that is more than one, also where it was rounded to 6.3. */
#define KMP_TURN      6.283185307179586
#define KMP_MORE_TURN 6.35
/* rad: an angle without a unit, from which on it is rather in degrees in any model. */
#define KMP_MANY_TURNS 45.0

typedef enum kmp_dimension_kind {
    KMP_DIMENSION_BARE,  /* a number without unit: a plain factor; as a whole value it fits any dimension */
    KMP_DIMENSION_FREE,  /* undetermined: fits any dimension, and so does any product with it */
    KMP_DIMENSION_KNOWN, /* power */
} kmp_dimension_kind;

typedef struct kmp_dimension {
    kmp_dimension_kind kind;
    double power[3]; /* of m, kg, s */
    bool angle;      /* of a required value: an angle or its rate, not any number; only for messages */
} kmp_dimension;

/* The dimensions that keys of the language require. */
#define KMP_DIM(m, kg, s) ((kmp_dimension){.kind = KMP_DIMENSION_KNOWN, .power = {(m), (kg), (s)}})
#define KMP_DIM_ANY       ((kmp_dimension){.kind = KMP_DIMENSION_FREE})
#define KMP_DIM_NUMBER    KMP_DIM(0, 0, 0)
#define KMP_DIM_LENGTH    KMP_DIM(1, 0, 0)
#define KMP_DIM_TIME      KMP_DIM(0, 0, 1)
#define KMP_DIM_FORCE     KMP_DIM(1, 1, -2)
#define KMP_DIM_TORQUE    KMP_DIM(2, 1, -2)

/** a * b^sign */
kmp_dimension kmp_dimension_times(kmp_dimension a, kmp_dimension b, double sign);
kmp_dimension kmp_dimension_power(kmp_dimension a, double exponent);

/** The dimension of a product of units with decimal powers, "N/m^1.5", "s/m", "1/s"; "": a plain number. */
kmp_dimension kmp_dimension_of(const char *unit);

/** False only when both are known and differ. */
bool kmp_dimension_fits(kmp_dimension a, kmp_dimension b);

/** True when it is known and not the dimension of a plain number. */
bool kmp_dimension_is_physical(kmp_dimension a);

/** In units: "kg", "N*m", "kg*m^-1", "a plain number". */
void kmp_dimension_print(kmp_text *text, kmp_dimension a);

/** The unit of SI as results name it, with blanks between its parts, "kg m^2"; "" of a plain number and of an unknown
 * dimension. */
void kmp_dimension_put_unit(kmp_text *text, kmp_dimension a);

/** Ends the message of a mass where a force or an acceleration is wanted: "lb" for lbf, "g" for gravity. */
void kmp_dimension_hint(kmp_text *text, kmp_dimension wanted, kmp_dimension found);

typedef struct kmp_unit {
    double factor, divisor; /* a number in this unit, times factor, by divisor, is in SI */
    kmp_dimension dimension;
    int angle; /* power of the angle: 1 for rad and rad/s, 0 for Hz */
} kmp_unit;

/** False when the first `length` characters of `name` are not a unit. */
bool kmp_unit_find(const char *name, size_t length, kmp_unit *unit);

/** Ends the message of an unknown unit: what it is written as, the nearest one, or examples. */
void kmp_unit_suggest(const char *name, size_t length, kmp_text *sentence);

/** A product of units, "N*m/rad", "N m", "rad/s^2", "1/m", the whole of `length` characters. False: no unit. */
bool kmp_unit_read(const char *s, size_t length, kmp_unit *unit);

/** unit = unit * other^power */
void kmp_unit_multiply(kmp_unit *unit, const kmp_unit *other, int power);

extern const kmp_name_list kmp_unit_names;
