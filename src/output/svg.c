/* SPDX-License-Identifier: BSD-3-Clause */
#include "output/svg.h"
#include <math.h>

void kmp_svg_begin(kmp_text *text, double width, double height, const char *style)
{
    kmp_text_put(text, "<svg xmlns=\"http://www.w3.org/2000/svg\" ");
    if (style)
        kmp_text_printf(text, "viewBox=\"0 0 %.0f %.0f\" ", width, height);
    kmp_text_printf(text, "width=\"%.0f\" height=\"%.0f\" font-family=\"sans-serif\" font-size=\"12\">\n", width,
                    height);
    if (style)
        kmp_text_printf(text, "<style>%s</style>\n", style);
    kmp_text_put(text, "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
}

void kmp_svg_end(kmp_text *text)
{
    kmp_text_put(text, "</svg>\n");
}

double kmp_svg_tick(double range, int count)
{
    double raw = range / count, power = pow(10, floor(log10(raw))), part = raw / power;
    return power * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
}

void kmp_svg_dot(kmp_text *text, double x, double y, double radius, const char *colour)
{
    kmp_text_printf(text, "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"%g\" fill=\"%s\"/>\n", x, y, radius, colour);
}
