% SPDX-License-Identifier: BSD-3-Clause
% An integrator of a user for generated equations with rigid contacts, which needs nothing of Kempe; of a model with the
% name machine:
%
%     kempe generate machine.yaml --lang octave --drives --sets M_C+h_J+jdqd,contact,impact -o folder
%     octave-cli contact_loop_octave.m folder STEP Q.. QD.. TIME..
%
% Runge-Kutta steps of order 4 end at the times, whose states it prints, and where an open contact has no distance left
% or a closed one no force: there it bisects. The contacts that touch strike together, by Newton's law. A contact closes
% where its next flight would take less than 1e-6 s.
1;

function closed = is_closed(modes, m)
    closed = modes(m.contact_modes + 1) > 0;
end

function modes = closed_modes(modes, m, closed)
    modes(m.contact_modes + 1) = closed;
    modes(m.contact_modes + 2) = 0;
end

% M x - J' y = first, J x = second. The row of a contact that is open is zero: its y is zero then.
function [x, y] = solve(M, J, first, second)
    n = rows(M);
    both = [M, -J'; J, diag(double(all(J == 0, 2)))] \ [first; second];
    x = both(1:n);
    y = both(n + 1:end);
end

function [qdd, lambda] = accelerate(x, modes)
    [M, C, h, J, jdqd] = machine_M_C_h_J_jdqd(x.t, x.q, x.qd, modes);
    [qdd, lambda] = solve(M, J, -C, -jdqd);
end

function to = step(x, size, modes)
    part = [0, 0.5, 0.5, 1];
    weight = [1, 2, 2, 1]/6;
    to = at = x;
    for stage = 1:4
        at.t = x.t + part(stage)*size;
        if stage > 1
            at.q = x.q + part(stage)*size*v;
            at.qd = x.qd + part(stage)*size*a;
        end
        a = accelerate(at, modes);
        v = at.qd;
        to.q = to.q + weight(stage)*size*v;
        to.qd = to.qd + weight(stage)*size*a;
    end
    to.t = x.t + size;
end

% Of each contact: its distance or, where it is closed, its force; negative where it changes.
function l = left(x, modes, m)
    [qdd, lambda] = accelerate(x, modes);
    [gap, gap_rate, push] = machine_contact(x.t, x.q, x.qd, lambda, modes);
    closed = is_closed(modes, m)(:);
    l = gap(:);
    l(closed) = push(closed);
end

% The contacts that touch strike or stay closed; one without a flight of its own closes.
function [x, modes, last] = strike(x, modes, m, last)
    none = zeros(numel(m.row_names), 1);
    row = m.contact_rows;
    [gap, before] = machine_contact(x.t, x.q, x.qd, none, modes);
    modes = closed_modes(modes, m, is_closed(modes, m)(:) | (gap < 1e-9 & before < 0));
    do
        [M, C, h, J] = machine_M_C_h_J_jdqd(x.t, x.q, x.qd, modes);
        given = machine_impact(x.t, x.q, x.qd, modes);
        [rates, impulse] = solve(M, J, M*x.qd, given);
        [least, c] = min(impulse(row));
        if least < 0
            closed = is_closed(modes, m);
            closed(c) = false;
            modes = closed_modes(modes, m, closed);
        end
    until least >= 0
    [gap, after] = machine_contact(x.t, x.q, rates, none, modes);
    rest = machine_impact(x.t, x.q, rates, modes);
    closed = is_closed(modes, m);
    for c = find(closed(:)' & before(:)' < 0)
        printf('impact %.17g\n', x.t);
        if after(c)/-before(c)*(x.t - last(c)) < 1e-6
            given(row(c)) = rest(row(c));
            printf('close %.17g\n', x.t);
        else
            closed(c) = false;
            last(c) = x.t;
        end
    end
    modes = closed_modes(modes, m, closed);
    x.qd = solve(M, J, M*x.qd, given);
end

words = argv();
addpath(words{1});
m = machine_model();
numbers = cellfun(@str2double, words(2:end));
n = numel(m.coordinate_names);
x = struct('t', 0, 'q', numbers(2:n + 1)(:), 'qd', numbers(n + 2:2*n + 1)(:));
modes = zeros(m.mode_entries*m.elements, 1);
last = -inf(numel(m.contact_names), 1);
for finish = numbers(2*n + 2:end)(:)'
    while finish - x.t > 1e-15
        high = min(numbers(1), finish - x.t);
        after = step(x, high, modes);
        if all(left(after, modes, m) >= 0)
            x = after;
            continue
        end
        low = 0;
        while high - low > 1e-15
            middle = (low + high)/2;
            if any(left(step(x, middle, modes), modes, m) < 0)
                high = middle;
            else
                low = middle;
            end
        end
        x = step(x, high, modes);
        closed = is_closed(modes, m)(:);
        opens = closed & left(x, modes, m) < 0;
        if any(opens)
            printf('open %.17g\n', x.t);
            modes = closed_modes(modes, m, closed & !opens);
        end
        [x, modes, last] = strike(x, modes, m, last);
    end
    printf('state'), printf(' %.17g', x.t, x.q, x.qd), printf('\n')
end
