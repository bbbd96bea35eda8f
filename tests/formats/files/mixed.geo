// A column of hexahedra, one of wedges beside it, tetrahedra and pyramids on top.
h = 0.34;
Point(1) = {0,0,0,h}; Point(2) = {1,0,0,h}; Point(3) = {1,1,0,h}; Point(4) = {0,1,0,h};
Point(5) = {2,0,0,h}; Point(6) = {2,1,0,h};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Line(5) = {2,5}; Line(6) = {5,6}; Line(7) = {6,3};
Transfinite Curve {1:7} = 4;
Curve Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};
Curve Loop(2) = {5,6,7,-2}; Plane Surface(2) = {2};
Transfinite Surface {1}; Recombine Surface {1};
a[] = Extrude {0,0,1} { Surface{1}; Layers{3}; Recombine; };
b[] = Extrude {0,0,1} { Surface{2}; Layers{3}; Recombine; };
c[] = Extrude {0,0,1} { Surface{a[0]}; };
Printf("top %g %g vol %g %g", a[0], b[0], a[1], c[1]);
Physical Volume("hexahedra", 11) = {a[1]};
Physical Volume("wedges", 12) = {b[1]};
Physical Volume("top", 13) = {c[1]};
Physical Surface("floor", 21) = {1, 2};
