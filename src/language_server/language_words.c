/* SPDX-License-Identifier: BSD-3-Clause */
#include "language_server/language_words.h"
#include "model/language/dimension.h"

#define FORM_1 "(x)"
#define FORM_2 "(x, y)"
#define FORM_3 "(a < b, x, y)"

static const kmp_language_word words[] = {
    {KMP_WORD_VARIABLE, "t", "t", "s", "time", false},
    {KMP_WORD_VARIABLE, "pi", "pi", "", "3.14159265358979", false},
    {KMP_WORD_VARIABLE, "q", "q(COORDINATE)", "rad or m", "value of a coordinate", true},
    {KMP_WORD_VARIABLE, "qd", "qd(COORDINATE)", "rad/s or m/s", "rate of a coordinate", true},
    {KMP_WORD_VARIABLE, "lambda", "lambda(LOOP.k)", "", "multiplier of a loop, a cut joint or a drive", true},
    {KMP_WORD_VARIABLE, "rate", "rate(x)", "", "derivative of an expression by time, along the motion", true},
#define KMP_FUNCTION(name, arity, value, node) {KMP_WORD_FUNCTION, #name, #name FORM_##arity, "", "", true},
#include "model/language/functions.def"
#undef KMP_FUNCTION
#define KMP_ARGUMENTS(...) #__VA_ARGS__
#define KMP_COMPOSITE(name, arity, arguments, formula)                                                                 \
    {KMP_WORD_FUNCTION, #name, #name "(" arguments ")", "", formula, true},
#include "model/language/composites.def"
#undef KMP_COMPOSITE
#undef KMP_ARGUMENTS
#define KMP_MEASURE(kind, word, argument, least, most, components, order, unit, meaning)                               \
    {KMP_WORD_MEASURE, word, word "(" #argument ")", unit, meaning, true},
#include "model/language/measures.def"
#undef KMP_MEASURE
#define MAY_BE_CALLED(argument) (sizeof #argument != sizeof "NOTHING")
#define KMP_OUTPUT(kind, word, argument, width, unit, meaning)                                                         \
    {KMP_WORD_OUTPUT, word, word, unit, meaning, MAY_BE_CALLED(argument)},
#include "model/data/output_kinds.def"
#undef KMP_OUTPUT
};

bool kmp_language_word_at(int k, kmp_language_word *word)
{
    const int count = (int)(sizeof words / sizeof *words);
    if (k < count) {
        *word = words[k];
        return true;
    }
    if (k - count >= kmp_unit_names.count)
        return false;
    const char *unit = kmp_name_at(kmp_unit_names, k - count);
    *word = (kmp_language_word){KMP_WORD_UNIT, unit, unit, "", "unit", false};
    return true;
}
