//! The terms that random forms have besides those that make them well-posed.

/// Of discontinuous scalar functions: their jumps.
pub const BROKEN: &[&str] = &[
    "9/avg(h)*jump(u)*jump(v)*dS",
    "-inner(avg(grad(u)), jump(v, n))*dS",
    "-inner(jump(u, n), avg(grad(v)))*dS",
];

/// Of scalar functions.
pub const SCALAR: &[&str] = &[
    "0.3*dot(b, grad(u))*v*dx",
    "0.2*u^3*v*dx",
    "0.2*sin(u)*v*dx",
    "g*v*ds(right)",
    "0.5*u*v*ds(left, top)",
    "0.05*dot(grad(u), n)*v*ds(bottom)",
    "0.1*u*inner(grad(u), grad(v))*dx",
    "0.1*h*dot(b, grad(u))*dot(b, grad(v))*dx",
    "0.1*max(u, f)*v*dx",
    "0.1*sqrt(1 + inner(grad(u), grad(u)))*v*dx",
    "0.1*avg(f*u)*avg(v)*dS",
    "0.1*exp(-u^2)*dot(b, grad(v))*dx",
    "0.1*g*u*v*ds",
    "0.1*conditional(x < 0.4, u, f)*v*dx",
    "0.1*u/(1 + u^2)*v*dx",
    "0.1*inner(cofac(outer(b, b) + Identity(2)), outer(grad(u), grad(v)))*dx",
    "0.1*inner(avg(grad(u)), avg(grad(v)))*avg(h)^2*dS",
    "0.1*atan2(u, 2 + f)*v*dx",
    "0.1*jump(grad(u), n)*jump(grad(v), n)*avg(h)*dS",
    "0.1*tr(outer(b, grad(u)))*v*dx",
    "0.1*dot(K, grad(u))[0]*grad(v)[1]*dx",
    "0.1*f*u*v*dx",
    "0.1*dot(dot(grad(u), K), grad(v))*dx",
];

/// Of vectors by components.
pub const VECTOR: &[&str] = &[
    "div(u)*div(v)*dx",
    "0.2*dot(dot(grad(u), u), v)*dx",
    "0.1*inner(cofac(Identity(2) + grad(u)), grad(v))*dx",
    "0.1*det(Identity(2) + grad(u))*div(v)*dx",
    "0.1*inner(dev(grad(u)), grad(v))*dx",
    "0.1*curl(u)*curl(v)*dx",
    "0.1*inner(skew(grad(u)), grad(v))*dx",
    "dot(n, v)*ds",
    "0.2*inner(outer(b, u), grad(v))*dx",
    "0.1*tr(grad(u))*u[0]*v[1]*dx",
    "0.1*inner(inv(Identity(2) + 0.1*grad(u)).T, grad(v))*dx",
    "g*dot(b, v)*ds(top)",
    "0.1*dot(avg(u), avg(v))*dS",
    "0.1*dot(dot(K, u), v)*dx",
    "0.1*inner(grad(u).T, grad(v))*dx",
    "0.1*sqrt(1 + dot(u, u))*dot(b, v)*dx",
    "0.1*dot(u, n)*dot(v, n)*ds(left)",
    "0.1*max(dot(u, n), g)*dot(v, n)*ds(right)",
    "0.1*jump(u, n)*jump(v, n)*dS",
    "0.1*dot(grad(f), u)*v[0]*dx",
];

/// For vectors of Raviart and Thomas; those of Nédélec have a curl.
pub const WHOLE: &[&str] = &[
    "0.2*dot(dot(K, u), v)*dx",
    "0.1*g*dot(v, n)*ds(right)",
    "0.1*sqrt(1 + dot(u, u))*dot(b, v)*dx",
    "0.1*max(dot(u, n), g)*dot(v, n)*ds(right)",
    "0.1*dot(jump(u), jump(v))*dS",
    "0.1*inner(grad(u), grad(v))*dx",
    "0.1*dot(dot(grad(u), b), v)*dx",
    "0.1*u[0]*u[1]*dot(b, v)*dx",
    "0.1*h*div(u)*div(v)*dx",
    "0.1*exp(-dot(u, u))*div(u)*div(v)*dx",
    "0.1*avg(div(u))*avg(div(v))*dS",
];

/// Of a second unknown, a pressure, in addition to those of the first.
pub const PRESSURE: &[&str] = &[
    "-0.1*p*q*dx",
    "-0.2*f*q*dx",
    "-0.1*(p + 0.2*p^3)*q*dx",
    "-0.1*abs(g)*p*q*ds(top)",
    "-0.1*avg(p)*avg(q)*dS",
    "-0.1*avg(h)*jump(p)*jump(q)*dS",
    "0.1*sin(p)*dot(b, v)*dx",
    "-0.1*conditional(x < 0.4, p, f)*q*dx",
    "g*q*ds(bottom)",
];
