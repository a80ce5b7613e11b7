"""From a log to regression: prepared rows, regressors joint by joint, normal equations, priors."""
