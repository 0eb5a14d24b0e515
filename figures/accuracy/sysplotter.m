% Connection and CCF of sysplotter's viscous three-link swimmer on its own grid, by its
% own functions, in Octave: CPU seconds of both are printed, values are saved.
%
% The folders of sysplotter and for the values are taken from the environment. Its
% functions are called one by one: sys_calcsystem, which calls them, needs classes that
% Octave lacks.

warning('off', 'all');
folder = getenv('SYSPLOTTER');
parts = {'sys_calcsystem_fcns', 'Utilities', 'Physics', 'Geometry'};
for k = 1:numel(parts)
    addpath(genpath(fullfile(folder, 'ProgramFiles', parts{k})));
end
addpath(fullfile(folder, 'UserFiles', 'GenericUser', 'Systems'));

s = sysf_three_link_lowRe('initialize', []);
s.A_num = s.A;
s = create_grids(s);

start = cputime;
s = evaluate_connection(s);
s = merge_connection(s);
seconds.connection = cputime - start;

A = s.vecfield.eval.content.Avec;
axes = cellfun(@unique, s.grid.eval, 'UniformOutput', false);
start = cputime;
ccf = calc_ccf(axes, A, @vec_to_mat_SE2_lie, @mat_to_vec_SE2_lie);
seconds.ccf = cputime - start;

release = version;
save('-v6', getenv('VALUES'), 'A', 'ccf', 'seconds', 'release');
