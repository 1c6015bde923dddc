// Attributes as properties: what a program sets as one is the other too.

/** Of properties that are true or false: what the attribute says where they are false. */
const WORDS = { autoplay: 'no', controls: 'none' };
const TEXTS = ['src', 'resolution', 'theme'];
/** Properties of their own that follow from attributes. */
const OTHERS = ['operatingPoint'];
const NAMES = [...Object.keys(WORDS), ...TEXTS];

/** What a text such as s0,t1,r2 names. */
export function pointOf(text) {
  const found = /^s(\d+),t(\d+),r(\d+)$/.exec(text ?? '');
  return found ? { spatial: Number(found[1]), temporal: Number(found[2]), refinement: Number(found[3]) } : {};
}

/** Sets an attribute, or removes it: null and empty texts mean none. */
function put(element, name, value) {
  if (value) element.setAttribute(name, value);
  else element.removeAttribute(name);
}

function propertyOf(name) {
  const word = WORDS[name];
  return {
    enumerable: true,
    configurable: true,
    get() {
      return word ? this.getAttribute(name) !== word : this.getAttribute(name) ?? '';
    },
    set(value) {
      put(this, name, word ? !value && word : value && String(value));
    },
  };
}

/** Gives a class of elements the properties. */
export function reflect(Class) {
  for (const name of NAMES) Object.defineProperty(Class.prototype, name, propertyOf(name));
}

/** Takes what was set on an element before its class was known, which hides the properties. */
export function takeEarly(element) {
  for (const name of [...NAMES, ...OTHERS].filter((one) => Object.hasOwn(element, one))) {
    const value = element[name];
    delete element[name];
    element[name] = value;
  }
}
