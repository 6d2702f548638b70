/* SPDX-License-Identifier: BSD-3-Clause */
/* The text of a model that a test writes, piece by piece. */
#pragma once

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

typedef struct scene {
    char text[65536];
    size_t length;
} scene;

static void put(scene *s, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(scene *s, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    s->length += (size_t)vsnprintf(s->text + s->length, sizeof s->text - s->length, format, arguments);
    va_end(arguments);
}
