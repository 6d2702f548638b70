% SPDX-License-Identifier: BSD-3-Clause
% Implicit blocks and averages over places, as in kempe_newton.h, which comes with generated C. The functions of a block
% take and return rows.

function size = kempe_largest(x)
    size = max(abs(x));
    if any(isnan(x))
        size = NaN;
    end
end

% The step -A^-1 f; NaN: singular.
function dy = kempe_direction(n, f)
    if n == 1
        dy = -f(1)/f(2);
    elseif n == 2
        a = reshape(f(3:6), 2, 2).';
        p = 1 + (abs(a(1, 1)) < abs(a(2, 1)));
        r = 3 - p;
        factor = a(r, 1)/a(p, 1);
        second = -(f(r) - factor*f(p))/(a(r, 2) - factor*a(p, 2));
        dy = [-(f(p) + a(p, 2)*second)/a(p, 1), second];
    else
        a = reshape(f(n + 1:n + n*n), n, n).';
        dy = NaN(1, n);
        if all(isfinite(a(:))) && rcond(a) > 0
            dy = (a\(-f(1:n).')).';
        end
    end
end

% Steps along dy; shorter where the residuals are NaN or grow.
function [there, dy, f] = kempe_advance(y, dy, equations, residual)
    n = numel(y);
    for k = 0:12
        there = y + dy;
        f = equations(there);
        if kempe_largest(f(1:n)) <= 2*residual
            break
        end
        if k < 12
            dy = 0.5*dy;
        end
    end
end

% The remaining error is rounding, judged by the step before.
function is = kempe_is_final(step, before, size)
    rate = step/before;
    is = (isfinite(before) && step <= 1e-8*size && step*rate*rate <= eps/4*size) || step <= 2*eps*size || ...
         (step <= 1e-9*size && step >= 0.5*before);
end

% Newton's iteration from y on; NaN: there is no solution.
function y = kempe_descend(y, equations)
    n = numel(y);
    before = Inf;
    f = equations(y);
    size = abs(y);
    for k = 1:60
        dy = kempe_direction(n, f);
        step = kempe_largest(dy);
        if ~isfinite(step)
            break
        end
        moving = dy ~= 0;
        part = max([0, abs(dy(moving))./size(moving)]);
        stands = isfinite(before) && part >= 0.9*before && step <= 1e-9*kempe_largest(size);
        if stands || kempe_is_final(part, before, 1)
            y = y + dy;
            return
        end
        [y, dy, f] = kempe_advance(y, dy, equations, kempe_largest(f(1:n)));
        grown = ~(abs(y) <= size);
        size(grown) = abs(y(grown));
        if ~isfinite(kempe_largest(size))
            break
        end
        before = Inf;
        if kempe_largest(dy) == step
            before = part;
        end
    end
    y = NaN(1, n);
end

% The values [residual, slope, slope of the merit, merit] at y, and whether they are finite.
function [good, values] = kempe_look(equations, merit, y)
    f = equations(y);
    m = merit(y);
    values = [f(1:3), m(1)];
    good = all(isfinite(values));
end

% The lowest point of the parabola through the merits of a candidate and its neighbours.
function y = kempe_lowest(c, m, k)
    y = c(k);
    if k > 1 && k < numel(c)
        left = (m(k) - m(k - 1))/(c(k) - c(k - 1));
        right = (m(k + 1) - m(k))/(c(k + 1) - c(k));
        curvature = (right - left)/(c(k + 1) - c(k - 1));
        y = c(k) - (left + curvature*(c(k) - c(k - 1)))/(2*curvature);
        if ~(y > c(k - 1) && y < c(k + 1))
            y = c(k);
        end
    end
end

% The interval about a candidate in which the least merit is searched, and the distance of candidates there.
function [low, high, spacing] = kempe_valley(c, best)
    low = -Inf;
    high = Inf;
    if best > 1
        low = c(best - 1);
    end
    if best < numel(c)
        high = c(best + 1);
    end
    spacing = min(high - c(best), c(best) - low);
    if isfinite(low) && isfinite(high)
        spacing = (high - low)/2;
    end
end

% The unknown near a candidate, and its merit; NaN: there is no solution.
function [y, least] = kempe_descend_among(c, m, best, equations, merit)
    [low, high, spacing] = kempe_valley(c, best);
    at = kempe_lowest(c, m, best);
    [good, v] = kempe_look(equations, merit, at);
    if ~(good && v(4) <= m(best))
        again = at ~= c(best);
        at = c(best);
        if again
            [good, v] = kempe_look(equations, merit, at);
        end
        if ~again || ~good
            y = NaN;
            least = Inf;
            return
        end
    end
    if ~isfinite(spacing)
        spacing = abs(v(1)/v(2));
    end
    before = Inf;
    for k = 1:60
        step = 0;
        if v(1) ~= 0
            step = -v(1)/v(2);
        end
        y = at + step;
        least = v(4);
        size = max(abs(at), spacing);
        downhill = step*v(3) <= 0;
        if ~isfinite(size)
            break
        end
        if step == 0 || ((downhill || k > 1) && kempe_is_final(abs(step), before, size))
            return
        end
        if v(3) > 0
            high = at;
        else
            low = at;
        end
        if ~(y > low && y < high) || ~downhill || abs(step) > before/2
            y = kempe_middle(at, v(3), low, high, spacing);
        end
        before = abs(y - at);
        if before == 0
            y = at;
            return
        end
        [good, next] = kempe_look(equations, merit, y);
        if good && ~(next(4) > v(4) && before > 1e-3*spacing)
            at = y;
            v = next;
        elseif y > at
            high = y;
        else
            low = y;
        end
    end
    y = NaN;
    least = Inf;
end

% Downhill, to the middle; where there is no end, by a spacing.
function y = kempe_middle(at, slope, low, high, spacing)
    way = high;
    if slope > 0
        way = low;
    end
    way = abs(way - at)/2;
    if ~isfinite(way)
        way = spacing;
    end
    y = at + way;
    if slope > 0
        y = at - way;
    end
end

% Whether a candidate is lower than its neighbours, and a lower bound of the merit there.
function [is, bound] = kempe_bound(c, m, k)
    first = k == 1;
    last = k == numel(c);
    bound = -Inf;
    is = isfinite(m(k)) && (first || ~(m(k - 1) < m(k))) && (last || ~(m(k + 1) <= m(k)));
    if is && ~first && ~last
        before = (m(k - 1) - m(k))/(c(k) - c(k - 1));
        after = (m(k + 1) - m(k))/(c(k + 1) - c(k));
        bound = m(k) - max(before*(c(k + 1) - c(k)), after*(c(k) - c(k - 1)));
    end
end

% From the best candidate, then from those that may have lower merit.
function y = kempe_solve_one_among(c, m, best, equations, merit)
    [y, least] = kempe_descend_among(c, m, best, equations, merit);
    for k = 1:numel(c)
        [is, bound] = kempe_bound(c, m, k);
        if k ~= best && is && bound < least
            [other, its] = kempe_descend_among(c, m, k, equations, merit);
            if its < least
                y = other;
                least = its;
            end
        end
    end
end

% All unknowns at a candidate of the first one.
function y = kempe_begin(n, first, guess)
    y = guess([first, zeros(1, n - 1)]);
    y = [first, y(2:n)];
end

% The n unknowns of a block; NaN without a solution. `rows`: candidates of the first one, with values by candidate.
function y = kempe_solve(n, rows, guess, merit, scan, equations)
    if isempty(rows)
        y = guess(zeros(1, n));
        y = kempe_descend(y(1:n), equations);
        return
    end
    m = Inf(1, size(rows, 1));
    for k = 1:numel(m)
        q = rows(k, 1);
        if n > 1
            q = kempe_begin(n, q, guess);
        end
        found = scan([q, rows(k, 2:end)]);
        m(k) = found(1);
    end
    usable = m;
    usable(~(m > -Inf)) = Inf;
    [least, best] = min(usable);
    if ~(least < Inf)
        y = NaN(1, n);
    elseif n == 1
        y = kempe_solve_one_among(rows(:, 1).', m, best, equations, merit);
    else
        y = kempe_descend(kempe_begin(n, rows(best, 1), guess), equations);
    end
end

% The logarithm of a sum over places, and n - 1 averages. Groups of eight places count by their middle.
function y = kempe_average(n, rows, averaged_rows, exponent, averaged)
    place = rows(:, 1).';
    last = numel(place);
    spacing = ([place(2:end), place(end)] - [place(1), place(1:end - 1)])/2;
    first = 1:8:last;
    middle = floor((first + min(first + 7, last) - 2)/2) + 1;
    x = zeros(1, numel(first));
    for k = 1:numel(first)
        e = exponent(rows(middle(k), :));
        x(k) = e(1);
    end
    [most, best] = max(x);
    if any(isnan(x))
        most = NaN;
    end
    if most + 24 < e(2)
        found = averaged(averaged_rows(middle(best), :));
        y = [x(best) + log(spacing(middle(best))), found(1:n - 1)];
        return
    end
    rising = max(0, max([0, x(1:end - 1) - x(2:end)], [x(2:end) - x(1:end - 1), 0]))/2 + 12;
    counting = find(~(x + rising < most - 24));
    places = zeros(1, 0);
    for k = counting
        places = [places, first(k):min(first(k) + 7, last)]; %#ok<AGROW>
    end
    weight = zeros(1, numel(places));
    for k = 1:numel(places)
        e = exponent(rows(places(k), :));
        weight(k) = e(1);
    end
    most = max(weight);
    if any(isnan(weight))
        most = NaN;
    end
    weight = exp(weight - most).*spacing(places);
    sums = zeros(1, n - 1);
    for k = 1:numel(places)
        found = averaged(averaged_rows(places(k), :));
        sums = sums + weight(k)*found(1:n - 1);
    end
    total = sum(weight);
    y = [most + log(total), sums/total];
end
