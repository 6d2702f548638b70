% SPDX-License-Identifier: BSD-3-Clause
% An integrator of a user for generated equations with continuous delays, which needs nothing of Kempe; of a model with
% the name machine:
%
%     kempe generate machine.yaml --lang octave --drives --sets M_C+h_J+jdqd,delay -o folder
%     octave-cli delay_loop_octave.m folder STEPS END Q.. QD..
%
% Runge-Kutta steps of order 4, of which each delay has a whole number. The signals at the ends of steps are kept;
% between them they are polynomials of degree 5, of which none extends over a multiple of the delay: derivatives may
% jump there. Prints q and qd at the end.
1;

% The signal of delay d after so many steps, by those from number `first` on.
function y = between(past, d, first, steps)
    nodes = first + (0:5);
    y = 0;
    for i = nodes
        others = nodes(nodes != i);
        y = y + past.kept(d, i + 1)*prod((steps - others)./(i - others));
    end
end

% The signal that delay d has after so many steps, within the present one.
function y = late(past, m, d, steps)
    at = steps - past.lag(d);
    begin = past.now - past.lag(d);
    if begin < 0 && !m.delay_given(d)
        y = past.kept(d, 1);
    elseif begin < 0
        none = zeros(numel(m.coordinate_names), 1);
        [signal, before] = machine_delay(at*past.size, none, none);
        y = before(d);
    else
        low = floor(begin/past.lag(d))*past.lag(d);
        y = between(past, d, min(max(floor(at) - 2, low), low + past.lag(d) - 5), at);
    end
end

function qd = with_delays(past, m, t, qd)
    for d = 1:numel(m.delay_places)
        qd(m.delay_places(d)) = late(past, m, d, t/past.size);
    end
end

% M qdd + C = J' lambda, J qdd + jdqd = 0.
function qdd = accelerate(past, m, t, q, qd)
    [M, C, h, J, jdqd] = machine_M_C_h_J_jdqd(t, q, with_delays(past, m, t, qd));
    both = [M, J'; J, zeros(rows(J))] \ -[C(:); jdqd(:)];
    qdd = both(1:numel(q));
end

words = argv();
addpath(words{1});
m = machine_model();
n = numel(m.coordinate_names);
numbers = cellfun(@str2double, words(2:end));
q = numbers(3:n + 2)(:);
qd = numbers(n + 3:end)(:);
past.size = numbers(2)/numbers(1);
[signal, before, delay] = machine_delay(0, q, qd);
past.lag = round(delay/past.size);
past.kept = zeros(numel(delay), numbers(1) + 1);
past.kept(:, 1) = signal;
for now = 0:numbers(1) - 1
    past.now = now;
    h = past.size;
    t = now*h;
    a = accelerate(past, m, t, q, qd);
    b = accelerate(past, m, t + h/2, q + h/2*qd, qd + h/2*a);
    c = accelerate(past, m, t + h/2, q + h/2*(qd + h/2*a), qd + h/2*b);
    d = accelerate(past, m, t + h, q + h*(qd + h/2*b), qd + h*c);
    q = q + h*qd + h^2/6*(a + b + c);
    qd = qd + h/6*(a + 2*b + 2*c + d);
    qd = with_delays(past, m, t + h, qd);
    past.kept(:, now + 2) = machine_delay(t + h, q, qd);
end
printf('%.17g %.17g\n', [q, qd]');
